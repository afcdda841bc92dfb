"""The end of a search: a time, a cancellation, or both. It is looked at between calls of kernels."""

from __future__ import annotations

import time
from dataclasses import dataclass, field


class CancelledError(Exception):
    """`Deadline.cancel` stopped the search; there is no answer."""


@dataclass(slots=True, eq=False)
class Deadline:
    """A cooperative end of the search: a time, a cancellation by another thread, or both.

    Attributes
    ----------
    at : float or None
        `time.monotonic()` seconds.
    """

    at: float | None = None
    _cancelled: bool = field(default=False, init=False)

    def cancel(self) -> None:
        """Make the search give up soon; safe from any thread."""
        self._cancelled = True

    @property
    def cancelled(self) -> bool:
        """Return whether `cancel` was called."""
        return self._cancelled

    @property
    def passed(self) -> bool:
        """Return whether the search has to end: it was cancelled, or its time is over."""
        return self.cancelled or (self.at is not None and time.monotonic() >= self.at)
