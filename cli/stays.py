"""Which of several maps a robot was on along a log."""

from __future__ import annotations

from dataclasses import dataclass, field

from .locators import Found


@dataclass(slots=True)
class Stay:
    """A part of a log with usable poses on one map; `first` and `last` are stamps of scans, seconds."""

    map_id: str
    first: float
    last: float
    scans: int = 1


@dataclass(slots=True)
class Stays:
    """The stays so far, in the order of the log; none where a single map is searched."""

    found: list[Stay] = field(default_factory=list)

    def take(self, stamp_ns: int, found: Found) -> None:
        """Add an answer; one that is not usable begins no stay and ends none."""
        if not found.usable or found.map_id is None:
            return
        stamp, last = 1e-9 * stamp_ns, self.found[-1] if self.found else None
        if last is None or last.map_id != found.map_id:
            self.found.append(Stay(found.map_id, stamp, stamp))
        else:
            last.last, last.scans = stamp, last.scans + 1
