"""Times: stamps of messages as numbers, and the clock of the robot, which may be that of a simulation."""

from __future__ import annotations

import time
from dataclasses import dataclass

from . import messages as ros
from .messages import Time

NS = 1_000_000_000


def nanoseconds(stamp: Time) -> int:
    """Return a time as one number."""
    return int(stamp.sec) * NS + int(stamp.nanosec)


def time_of(stamp: int) -> Time:
    """Return nanoseconds as a time of messages."""
    return Time(*divmod(stamp, NS))


@dataclass(slots=True)
class Clock:
    """The clock that messages are stamped by, and that ages of inputs are measured with.

    Attributes
    ----------
    simulated : bool
        True: the clock of a simulation, which comes over ``/clock`` and may stand still.
    """

    simulated: bool = False
    _now: int = 0

    def take(self, message: ros.Clock) -> None:
        """Take the time of a simulation."""
        self._now = nanoseconds(message.clock)

    @property
    def started(self) -> bool:
        """Return whether there is a time."""
        return not self.simulated or self._now > 0

    def now(self) -> Time:
        """Return the time, as messages are stamped with."""
        return time_of(self._now if self.simulated else time.time_ns())

    def steady(self) -> int:
        """Return nanoseconds of a clock that is not set, unless a simulation begins again."""
        return self._now if self.simulated else time.monotonic_ns()
