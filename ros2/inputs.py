"""The watch over what the node receives: ages, contradictions and clocks of scans, odometry, transforms and the map."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from .messages import LaserScan
from .odometry import OdometryHistory, nanoseconds
from .options import NodeOptions
from .topics import Topics
from .tuning import CLOCKS_APART, ENDED_SECONDS, SILENT_SECONDS
from .wire import Subscription


class Inputs:
    """Watches the inputs; logs what is missing for `SILENT_SECONDS`.

    Parameters
    ----------
    options : NodeOptions
    topics : Topics
    odometry : OdometryHistory
    log : callable
        Takes a line; the same line again and again.
    """

    def __init__(
        self, options: NodeOptions, topics: Topics, odometry: OdometryHistory, log: Callable[[str], None]
    ) -> None:
        self._options, self._topics, self._odometry, self._log = options, topics, odometry, log
        self._began = self._searched = self._looked = time.monotonic()
        self._scanned = self._ranged = -math.inf  # a scan, and one with ranges
        self._latency: int | None = None  # ns from the stamp of the last scan to its reception
        self._apart = 0  # scans one after the other whose clock differs from that of odometry
        self._mapped = options.map_topic is None

    def scan(self, scan: LaserScan) -> None:
        """Note that a scan has come."""
        if self._latency is None:
            self._log(f"first scan on {self._topics.scans[0].name}")
        self._scanned, stamp = time.monotonic(), nanoseconds(scan.header.stamp)
        ranges = np.asarray(scan.ranges)
        if ((ranges >= scan.range_min) & (ranges <= scan.range_max)).any():
            self._ranged = self._scanned
        self._latency = time.monotonic_ns() - stamp
        offset = self._odometry.clock_offset(stamp, time.monotonic_ns())
        self._apart = self._apart + 1 if abs(offset) > CLOCKS_APART and self._odometry.silent_s < ENDED_SECONDS else 0

    def map(self) -> None:
        """Note that a map has come: if it is not used, that is another problem."""
        self._mapped = True

    def searched(self) -> None:
        """Note that a scan is searched."""
        self._searched = time.monotonic()

    def received(self, stamp: int) -> int | None:
        """Return when a scan with a stamp was received, as `time.monotonic_ns` counts."""
        return None if self._latency is None else stamp + self._latency

    @property
    def doubt(self) -> str:
        """Why the present inputs do not confirm a pose; empty where they may."""
        now, odometry = time.monotonic(), self._odometry
        if now - self._scanned > ENDED_SECONDS:
            return f"no scan arrives on {', '.join(one.name for one in self._topics.scans)}"
        if now - self._ranged > ENDED_SECONDS:
            return "no scan has a range between range_min and range_max"
        if odometry.source and odometry.silent_s > ENDED_SECONDS:
            return f"no odometry arrives any more on {odometry.source}"
        if odometry.jump:
            return f"odometry on {odometry.source} contradicts itself"
        if self._apart >= 3:
            return f"the clocks of scans and of odometry on {odometry.source} differ"
        return ""

    @property
    def transform_stops(self) -> bool:
        """Return whether the transform is not to be published any more."""
        most = self._options.tf_max_age_s
        return 0.0 < most < time.monotonic() - self._ranged

    @property
    def values(self) -> dict[str, str]:
        """Ages of the inputs, and what is wrong with them, as keys and values for diagnostics."""
        now = time.monotonic()
        ages = {"scan": now - self._scanned, "ranges": now - self._ranged, "odometry": self._odometry.silent_s}
        told = {f"{name} age": f"{age:.1f} s" if math.isfinite(age) else "never" for name, age in ages.items()}
        return {**told, "odometry source": self._odometry.source, "input problem": self.doubt}

    def look(self) -> None:
        """Log missing and contradicting inputs."""
        now = time.monotonic()
        if now - self._looked < min(1.0, SILENT_SECONDS):
            return
        self._looked = now
        silent = now - max(self._began, self._scanned) >= SILENT_SECONDS
        if silent:
            for topic in self._topics.scans:
                self._log(self._reason(topic))
        elif self._latency is not None and now - max(self._began, self._ranged) >= SILENT_SECONDS:
            self._log(
                f"no scan has had a range between range_min and range_max for {SILENT_SECONDS:g} s; check the laser"
            )
        if not self._mapped:
            self._log(self._reason(self._topics.maps[0]))
        elif not silent and now - self._searched >= SILENT_SECONDS:
            self._log("scans arrive, but none can be searched; read the problem on /diagnostics")
        self._look_at_odometry()
        for one in self._topics.transforms:
            if one.subscription.incompatible:
                name = one.subscription.name
                self._log(f"a publisher of {name} has an incompatible QoS; publish {name} with reliable QoS")
        if self._topics.initial.incompatible:
            self._log(
                f"a subscriber of {self._topics.initial.name} requests an incompatible QoS; expected reliable or best "
                "effort, volatile"
            )

    def _look_at_odometry(self) -> None:
        odometry, topic = self._odometry, self._topics.odometry
        if min(odometry.silent_s, time.monotonic() - self._began) >= SILENT_SECONDS:
            self._log(f"no odometry: {self._reason(topic)}; without it, scans agree only at rest")
        elif odometry.jump:
            count = topic.publishers
            remedy = (
                f"stop all but one of the {count} publishers of {topic.name}"
                if count > 1
                else "its publisher was reset, or merges two sources"
            )
            self._log(
                f"odometry on {odometry.source} contradicts itself: {odometry.jump}; {remedy}. Odometry near such "
                "steps is not used"
            )
        elif self._apart >= 3 and self._latency is not None:
            now = time.monotonic_ns()
            offset = odometry.clock_offset(now - self._latency, now)
            self._log(
                f"the stamps of scans are {abs(offset):.1f} s {'behind' if offset > 0.0 else 'ahead of'} those of "
                f"odometry on {odometry.source}; expected at most {CLOCKS_APART:g} s. Synchronize the clocks; "
                "odometry is not used until then"
            )

    def _reason(self, topic: Subscription[Any]) -> str:
        domain = self._options.domain
        if topic.publishers:
            silent = f"no valid message on {topic.name} for {SILENT_SECONDS:g} s, although it has a publisher"
            return f"{silent}; check the driver and the network"
        if topic.incompatible:
            return (
                f"the publisher of {topic.name} in domain {domain} has an incompatible QoS; publish with reliable QoS"
            )
        return f"no publisher on {topic.name} in domain {domain}; check the topic, ROS_DOMAIN_ID and the network"
