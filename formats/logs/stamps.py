"""The stamps of a log's scans: those that are 0, that repeat, or that jump back."""

from __future__ import annotations

from dataclasses import dataclass

from ..report import Notes

NS = 1e-9


@dataclass(slots=True)
class Stamps:
    """Takes the stamps of scans in the order of the log, and notes what is wrong with them."""

    notes: Notes
    _last: int | None = None
    _farthest_back: float = 0.0  # s

    def of(self, stamp: int, received: int | None = None) -> int:
        """Return the stamp to use for the next scan, nanoseconds.

        Parameters
        ----------
        stamp : int
            As the message has it; 0 where its sender has set none.
        received : int, optional
            When the recorder received it.
        """
        if stamp == 0 and received:
            said = "scans without a stamp, which have the time at which the recorder received them"
            self.notes.add_assumed("stamp_received", said, 1)
            stamp = received
        if self._last is not None and stamp == self._last:
            self.notes.add_assumed("stamp_repeated", "scans with the stamp of the scan before", 1)
        elif self._last is not None and stamp < self._last:
            self._farthest_back = max(self._farthest_back, (self._last - stamp) * NS)
            said = f"scans with a stamp before that of the scan before, by up to {self._farthest_back:.3f} s"
            self.notes.add_assumed("stamp_back", said, 1)
        self._last = stamp
        return stamp
