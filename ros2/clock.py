"""The clock of the robot, which may be that of a simulation; and stamps that do not fit it."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Generic, TypeVar

from . import messages as ros
from .messages import NS, Time, nanoseconds

Value = TypeVar("Value")


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


@dataclass(slots=True)
class Confirmation(Generic[Value]):
    """Holds a value whose stamp is far from the time, until the next one confirms its clock.

    Attributes
    ----------
    longest : float
        From the held value to the next one, nanoseconds.
    """

    longest: float = math.inf
    _held: tuple[int, Value] | None = None

    def take(self, stamp: int, value: Value, *, fits: bool) -> list[Value]:
        """Return the values to use now: this one if it `fits`; else the held one and this one, or none."""
        held, self._held = self._held, None
        if fits:
            return [value]
        if held is None or not 0 < stamp - held[0] <= self.longest:
            self._held = stamp, value
            return []
        return [held[1], value]
