"""Requests with an id, and their results: where the robot is, as soon as scans agree."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from .messages import DiagnosticStatus, PoseWithCovarianceStamped, String
from .options import MAX_NAME
from .reporting import ERROR, OK, status_of
from .topics import Publisher, Subscription
from .tuning import RESULT_SECONDS

MOST_REQUESTS = 100  # that wait for a pose


@dataclass(slots=True)
class Requests:
    """Answers each request once: with the agreed pose, or that none was agreed in time.

    Attributes
    ----------
    requests : Subscription of String
        Their data is an id that the requester chooses.
    results : Publisher of DiagnosticStatus
        Their name is the id.
    """

    requests: Subscription[String]
    results: Publisher[DiagnosticStatus]
    _waiting: dict[str, float] = field(default_factory=dict)

    def take(self) -> bool:
        """Return whether requests have come."""
        messages = self.requests.take()
        for message in messages:
            name = message.data
            if len(name) > MAX_NAME or len(self._waiting) >= MOST_REQUESTS:
                problem = (
                    f"the request is ignored: expected an id of at most {MAX_NAME} "
                    f"characters, and at most {MOST_REQUESTS} open requests"
                )
                self.results.publish(status_of(name[:MAX_NAME], "", (ERROR, problem)))
            else:
                self._waiting[name] = time.monotonic()
        return bool(messages)

    def answer(self, agreed: PoseWithCovarianceStamped, map_name: str) -> None:
        """Answer all open requests with a pose, and the name of its map."""
        if not self._waiting:
            return
        place, turn = agreed.pose.pose.position, agreed.pose.pose.orientation
        values = {
            "map_id": map_name,
            "frame_id": agreed.header.frame_id,
            "x": f"{place.x:.4f}",
            "y": f"{place.y:.4f}",
            "qz": f"{turn.z:.6f}",
            "qw": f"{turn.w:.6f}",
            "stamp": f"{agreed.header.stamp.sec}.{agreed.header.stamp.nanosec:09d}",
        }
        for name in self._waiting:
            self.results.publish(status_of(name, "", (OK, "the pose is agreed"), values))
        self._waiting.clear()

    def expire(self) -> None:
        """Answer the requests that have waited too long."""
        now = time.monotonic()
        for name, since in list(self._waiting.items()):
            if now - since > RESULT_SECONDS:
                del self._waiting[name]
                problem = (
                    f"no pose was agreed within {RESULT_SECONDS:g} s; drive 0.5 m or rotate "
                    "by 30 degrees, and read /diagnostics"
                )
                self.results.publish(status_of(name, "", (ERROR, problem)))
