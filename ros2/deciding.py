"""When ``initialpose`` is published. No DDS in here."""

from __future__ import annotations

from dataclasses import dataclass

from .agreement import Event
from .options import When
from .tuning import ALWAYS_SECONDS, LOST_SECONDS


@dataclass(slots=True)
class InitialPose:
    """Decides, scan by scan, whether the agreed pose is published.

    Attributes
    ----------
    when : "start", "lost" or "always"
    """

    when: When = "start"
    _wanted: bool = True
    _published: bool = False
    _at: float | None = None

    @property
    def wanted(self) -> bool:
        """Return whether the next agreed pose is published unless the localizer has it already."""
        return self._wanted

    def want(self) -> None:
        """Publish the next agreed pose, after a request or a new subscription."""
        self._wanted = True

    def decide(self, event: Event, *, localizer_agrees: bool | None, lost: bool, now: float) -> str | None:
        """Return why the agreed pose is published; None where it is not.

        Parameters
        ----------
        event : Event
            Of the scan.
        localizer_agrees : bool or None
            True when the localizer has this pose; None: not known.
        lost : bool
            True when it has had another one for some scans.
        now : float
            `time.monotonic()`, seconds.
        """
        if event not in (Event.AGREED, Event.CONFIRMED):
            return None
        if localizer_agrees and self.when != "always":
            self._wanted = False
            return None
        if self._wanted:
            return "agreed"
        if event is Event.AGREED and self._published:
            return "corrected"  # the pose published before is contradicted
        since = LOST_SECONDS if self._at is None else now - self._at
        if lost and self.when != "start" and since >= LOST_SECONDS:
            return "lost"
        return "always" if self.when == "always" and since >= ALWAYS_SECONDS else None

    def published(self, *, subscribed: bool, now: float) -> None:
        """Note that the pose was published; without a subscriber it stays wanted."""
        self._wanted, self._published, self._at = not subscribed, True, now
