"""Reports of the node about itself: diagnostics, status, and lines of a log."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum

from .messages import DiagnosticArray, DiagnosticStatus, Header, KeyValue, Time
from .reporting import ERROR, OK, WARN
from .topics import Publisher
from .tuning import LOG_SECONDS, REPEAT_SECONDS

NUMBER = re.compile(r"(?<![\w/])[-+]?(?:\d+(?:\.\d*)?(?:e[-+]?\d+)?|nan|inf)(?!\w)")
MOST_PROBLEMS = 100  # different ones that are remembered


class State(Enum):
    """The state of the node: its name, its level and its message in diagnostics."""

    NO_MAP = "no_map", WARN, "no usable map has been received"
    NO_SCAN = "no_scan", WARN, "no scan can be searched"
    SEARCHING = "searching", WARN, "no pose is agreed yet"
    AGREED = "agreed", OK, "the pose is agreed"
    CONTRADICTED = "contradicted", ERROR, "the agreed pose is contradicted by the last scans"
    LOST = "lost", ERROR, "the pose of the localizer differs from that of the scans"
    STALE = "stale", ERROR, "the agreed pose is not confirmed any more"


@dataclass(slots=True)
class Health:
    """Publishes the node's reports.

    Attributes
    ----------
    diagnostics : Publisher of DiagnosticArray
    status : Publisher of DiagnosticStatus
    names : (str, str)
        Prefix of the names in diagnostics, and hardware id.
    log : callable
        Takes a line.
    """

    diagnostics: Publisher[DiagnosticArray]
    status: Publisher[DiagnosticStatus]
    names: tuple[str, str]
    log: Callable[[str], None]
    _published: dict[str, float] = field(default_factory=dict)
    _logged: dict[str, float] = field(default_factory=dict)
    _state: State | None = None
    _map: str | None = None
    _beat: float = 0.0

    def problem(self, problem: str, stamp: Time | None = None, *, about: str | None = None, level: int = ERROR) -> None:
        """Publish a problem, and log it: at most once in `REPEAT_SECONDS` and `LOG_SECONDS`.

        One `about` the same, or the same but for numbers, is the same one; its level is that of a warning or an error.
        """
        about = about or NUMBER.sub("#", problem)
        if _is_new(self._published, about, REPEAT_SECONDS):
            self.publish("scan", stamp or Time(), (level, problem))
        self.note(problem, about)

    def note(self, line: str, about: str | None = None) -> None:
        """Log a line; one `about` the same, or the same but for numbers, at most once in `LOG_SECONDS`."""
        if _is_new(self._logged, about or NUMBER.sub("#", line), LOG_SECONDS):
            self.log(line)

    def publish(
        self, part: str, stamp: Time, verdict: tuple[int, str], values: Mapping[str, str] | None = None
    ) -> None:
        """Publish diagnostics of a part of the node."""
        self.diagnostics.publish(DiagnosticArray(Header(stamp, ""), [self._status(part, verdict, values)]))

    def _status(self, part: str, verdict: tuple[int, str], values: Mapping[str, str] | None) -> DiagnosticStatus:
        (level, message), (prefix, hardware_id) = verdict, self.names
        pairs = [KeyValue(key, value) for key, value in (values or {}).items()]
        return DiagnosticStatus(level, f"{prefix}linefix: {part}", message, hardware_id, pairs)

    def beat(self, state: State, stamp: Time, values: Mapping[str, str], doubt: str = "") -> None:
        """Publish the state, with why it is no better: at once where it or the map has changed, else once a second."""
        now = time.monotonic()
        changed, map_changed = state is not self._state, values.get("map_id") != self._map
        if not changed and not map_changed and now - self._beat < 1.0:
            return
        self._beat, self._map = now, values.get("map_id")
        name, level, message = state.value
        values = {"state": name, **values}
        verdict = level, f"{message}: {doubt}" if doubt and level != OK else message
        self.publish("localization", stamp, verdict, values)
        self.status.publish(self._status("localization", verdict, values))
        if changed:
            self._state = state
            self.log(f"state {name}: {verdict[1]}")


def _is_new(times: dict[str, float], text: str, seconds: float) -> bool:
    now = time.monotonic()
    if now - times.get(text, -seconds) < seconds:
        return False
    if len(times) >= MOST_PROBLEMS:
        times.clear()
    times[text] = now
    return True
