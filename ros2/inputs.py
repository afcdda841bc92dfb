"""The watch over what the node receives: ages, contradictions and clocks of scans, odometry, transforms and the map."""

from __future__ import annotations

import math
import time
from collections import Counter, deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from formats.logs.tuning import CLOCKS_APART_NS

from .messages import NS, LaserScan, nanoseconds
from .options import quoted
from .robot import Robot
from .topics import Subscription
from .tuning import ENDED_SECONDS, MISSED_PERIODS, SEVERAL_SCANS, SILENT_SECONDS


@dataclass(slots=True)
class _Seen:
    """When something was last received, and how long after the one before; seconds."""

    last: float = -math.inf
    period: float = 0.0

    def note(self, now: float) -> None:
        self.period, self.last = min(now - self.last, SILENT_SECONDS), now


class Inputs:
    """Watches the inputs; logs what is missing for `SILENT_SECONDS`, and what contradicts itself.

    Parameters
    ----------
    robot : Robot

    Attributes
    ----------
    latency : int
        From the stamp of the last scan to its reception, as `Clock.steady` counts, nanoseconds.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot, self._topics, self._odometry, self._clock = robot, robot.topics, robot.odometry, robot.clock
        self._began: float | None = None
        self._started: float | None = None  # the same without a clock
        self._looked = time.monotonic()
        self._scans, self._ranges, self._searched = _Seen(), _Seen(), _Seen()
        self._senders: deque[tuple[float, str, Any]] = deque(maxlen=200)  # time, frame and publisher of the last scans
        self.latency = self._offset = 0
        self._apart = 0  # scans one after the other whose clock differs from that of odometry by such an offset
        self._disagreeing: float | None = None  # since when scans are usable, but none is agreed
        self._mapped = robot.options.map_topic is None

    def scan(self, scan: LaserScan) -> None:
        """Note that a scan has come."""
        if self._scans.last == -math.inf:
            self._robot.health.note(f"first scan on {self._topics.scans[0].name}")
        now, received, stamp = self._now, self._clock.steady(), nanoseconds(scan.header.stamp)
        self._scans.note(now)
        ranges = np.asarray(scan.ranges)
        if ((ranges >= scan.range_min) & (ranges <= scan.range_max)).any():
            self._ranges.note(now)
            info = getattr(scan, "sample_info", None)
            self._senders.append((now, scan.header.frame_id, getattr(info, "publication_handle", None)))
        self.latency = received - stamp
        self._offset = self._odometry.clock_offset(stamp, received)
        apart = abs(self._offset) > CLOCKS_APART_NS and self._odometry.silent_s < ENDED_SECONDS
        self._apart = self._apart + 1 if apart else 0

    def map(self) -> None:
        """Note that a map has come: if it is not used, that is another problem."""
        self._mapped = True

    def searched(self) -> None:
        """Note that a scan is searched."""
        self._searched.note(self._now)

    def result(self, *, usable: bool, agreed: bool) -> None:
        """Note whether the result of a scan is usable, and whether it is agreed."""
        if agreed:
            self._disagreeing = None
        elif usable and self._disagreeing is None:
            self._disagreeing = self._now

    @property
    def _now(self) -> float:
        return self._clock.steady() / NS

    @property
    def shared(self) -> str:
        """The frame of which several publishers send scans: all but one are not where it is; empty: none."""
        while self._senders and self._now - self._senders[0][0] > ENDED_SECONDS:
            self._senders.popleft()
        scans = Counter((frame, publisher) for _, frame, publisher in self._senders)
        frames = Counter(frame for (frame, _), count in scans.items() if count >= SEVERAL_SCANS)
        return next((frame for frame, count in frames.items() if count > 1), "")

    @property
    def doubt(self) -> str:
        """Why the present inputs do not confirm a pose; empty where they may."""
        return next((doubt for doubt, _ in self._problems(ENDED_SECONDS) if doubt), "")

    @property
    def transform_stops(self) -> bool:
        """Return whether the transform is not to be published any more."""
        return 0.0 < self._robot.options.tf_max_age_s < self._now - self._ranges.last

    @property
    def values(self) -> dict[str, str]:
        """Ages of the inputs, and what is wrong with them, as keys and values for diagnostics."""
        now, odometry = self._now, self._odometry
        ages = {"scan": now - self._scans.last, "ranges": now - self._ranges.last, "odometry": odometry.silent_s}
        shown = {f"{name} age": f"{age:.1f} s" if math.isfinite(age) else "never" for name, age in ages.items()}
        return {**shown, "odometry source": odometry.source, "input problem": self.doubt}

    def look(self) -> None:
        """Log missing and contradicting inputs."""
        if time.monotonic() - self._looked >= min(1.0, SILENT_SECONDS):
            self._looked = time.monotonic()
            for _, line in self._problems(SILENT_SECONDS):
                self._robot.health.note(line)

    def _problems(self, patience: float) -> Iterator[tuple[str, str]]:
        """Yield what is missing for some seconds, and what contradicts itself: the doubt, and a line with the remedy.

        Inputs that were never there are no doubt.
        """
        topics, odometry, now = self._topics, self._odometry, self._now
        self._started = self._started or time.monotonic()
        if not self._clock.started:
            if time.monotonic() - self._started > patience:
                yield "", "no message on /clock; start the simulation, or unset use_sim_time"
            return
        self._began = began = now if self._began is None else min(self._began, now)

        def silent(seen: _Seen) -> bool:
            return now - max(began, seen.last) > max(patience, min(SILENT_SECONDS, MISSED_PERIODS * seen.period))

        if silent(self._scans):
            names = ", ".join(one.name for one in topics.scans)
            yield from ((f"no scan arrives on {names}", self._reason(one)) for one in topics.scans)
        elif silent(self._ranges):
            told = "no scan has a range between range_min and range_max"
            yield told, f"{told} for {SILENT_SECONDS:g} s; check the laser, and that its ranges are in metres"
        if not self._mapped and now - began > patience:
            yield "", self._reason(topics.maps[0])
        elif not silent(self._scans) and silent(self._searched):
            yield "", "scans arrive, but none can be searched; read the problem on /diagnostics"
            remedy = "is best effort, so that earlier messages are lost; publish reliable and transient local"
            lossy = (one.subscription.name for one in topics.transforms if one.lossy)
            yield from (("", f"a publisher of {name} {remedy}") for name in lossy)
        if min(odometry.silent_s, now - began) > patience:
            reason = f"{self._reason(topics.odometry)}; or set --odom-frame, if it comes in tf"
            doubt = f"no odometry arrives any more on {odometry.source}" if odometry.source else ""
            yield doubt, f"no odometry: {reason}. Without it, scans agree only at rest"
        elif odometry.jump:
            yield f"odometry on {odometry.source} contradicts itself", self._jump
        elif odometry.frames:
            frames = " and ".join(map(quoted, odometry.frames))
            told = f"odometry on {odometry.source} alternates between the frames {frames}"
            yield told, f"{told}: it has several publishers; stop all but one. Odometry is not used until then"
        elif odometry.apart:
            told = f"odometry on {odometry.source} and tf differ by {odometry.apart} in {quoted(odometry.frame)}"
            remedy = "stop one of the two publishers, or set --odom to the topic of the one that publishes tf"
            wrong = "the transform from the map would be wrong by that"
            yield told if self._robot.options.publish_tf else "", f"{told}; {remedy}. With --publish-tf, {wrong}"
        elif self._apart >= 3:
            line = f"{odometry.clocks(self._offset)} not used while the robot moves"
            yield f"the clocks of scans and of odometry on {odometry.source} differ", line
        if self.shared:
            frame = f"several publishers send scans of the frame {quoted(self.shared)}"
            yield frame, f"{frame}, expected one; stop the others, or give each laser a frame of its own"
        if self._disagreeing is not None and now - self._disagreeing > SILENT_SECONDS:
            yield (
                "usable scans do not agree",
                f"scans are usable, but have not agreed for {SILENT_SECONDS:g} s; drive 0.5 m or rotate by 30 degrees. "
                "If the robot has driven, scans contradict odometry: check odometry and the mount of the laser",
            )
        if topics.initial.readers.incompatible:
            yield (
                "",
                f"a subscriber of {topics.initial.name} requests an incompatible QoS; expected reliable or best "
                "effort, volatile",
            )

    @property
    def _jump(self) -> str:
        topic, odometry = self._topics.odometry, self._odometry
        remedy = "its publisher was reset, or merges two sources"
        if len(topic.writers.connected) > 1:
            remedy = f"stop all but one of the {len(topic.writers.connected)} publishers of {topic.name}"
        return (
            f"odometry on {odometry.source} contradicts itself: {odometry.jump}; {remedy}. Odometry near such steps is "
            "not used"
        )

    def _reason(self, topic: Subscription[Any]) -> str:
        domain = self._robot.options.domain
        if topic.writers.connected:
            silent = f"no valid message on {topic.name} for {SILENT_SECONDS:g} s, although it has a publisher"
            return f"{silent}; check the driver and the network"
        if topic.writers.incompatible:
            return (
                f"the publisher of {topic.name} in domain {domain} has an incompatible QoS; publish with reliable QoS"
            )
        return f"no publisher on {topic.name} in domain {domain}; check the topic, ROS_DOMAIN_ID and the network"
