"""Why nothing happens: lines for the log when scans, a map or a transform do not come."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from .options import NodeOptions
from .topics import Topics
from .tuning import SILENT_SECONDS
from .wire import Subscription


class Silence:
    """Looks once in `SILENT_SECONDS` for missing input.

    Parameters
    ----------
    options : NodeOptions
    topics : Topics
    log : callable
        Takes a line.
    """

    def __init__(self, options: NodeOptions, topics: Topics, log: Callable[[str], None]) -> None:
        self._options, self._topics, self._log = options, topics, log
        self._scanned = self._searched = self._looked = time.monotonic()
        self._first = True
        self._mapped = options.map_topic is None

    def scan(self) -> None:
        """Note that a scan has come."""
        if self._first:
            self._log(f"first scan on {self._topics.scans[0].name}")
        self._first, self._scanned = False, time.monotonic()

    def map(self) -> None:
        """Note that a map has come: if it is not used, that is another problem."""
        self._mapped = True

    def searched(self) -> None:
        """Note that a scan is searched."""
        self._searched = time.monotonic()

    def look(self) -> None:
        """Log missing input."""
        now = time.monotonic()
        if now - self._looked < SILENT_SECONDS:
            return
        self._looked = now
        if now - self._scanned >= SILENT_SECONDS:
            for topic in self._topics.scans:
                self._log(self._reason(topic))
        if not self._mapped:
            self._log(self._reason(self._topics.maps[0]))
        elif now - self._scanned < SILENT_SECONDS <= now - self._searched:
            self._log("scans arrive, but none can be searched; read the problem on /diagnostics")
        if self._topics.initial.incompatible:
            self._log(
                f"a subscriber of {self._topics.initial.name} requests an incompatible QoS; expected reliable or best "
                "effort, volatile"
            )

    def _reason(self, topic: Subscription[Any]) -> str:
        domain = self._options.domain
        if topic.publishers:
            silent = f"no message on {topic.name} for {SILENT_SECONDS:g} s, although it has a publisher"
            return f"{silent}; check the driver and the network"
        if topic.incompatible:
            return (
                f"the publisher of {topic.name} in domain {domain} has an incompatible QoS; publish with reliable QoS"
            )
        return f"no publisher on {topic.name} in domain {domain}; check the topic, ROS_DOMAIN_ID and the network"
