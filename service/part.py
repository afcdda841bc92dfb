"""Which part of the service a process is."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Part:
    """One of several worker processes, or the only one.

    Attributes
    ----------
    index, of : int
    replaces : bool
        Whether it stands in for one that has died: then it is to be ready before it takes connections, since the
        others take them meanwhile.
    """

    index: int = 0
    of: int = 1
    replaces: bool = False

    def share(self, whole: int) -> int:
        """Return this part's share of something; all shares add up to the whole."""
        return whole // self.of + (self.index < whole % self.of)


WHOLE = Part()
