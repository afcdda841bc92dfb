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
        Whether it stands in for one that has died.
    """

    index: int = 0
    of: int = 1
    replaces: bool = False

    @property
    def is_first(self) -> bool:
        """Whether it may make what has to be there once; the others come to what is there."""
        return self.index == 0 and not self.replaces

    @property
    def opens_late(self) -> bool:
        """Whether it takes connections only when it is ready: others take them meanwhile, or the first says why not.

        A service is ready as soon as one of its processes is. No other may take a request that it has to refuse.
        """
        return not self.is_first

    def share(self, whole: int) -> int:
        """Return this part's share of something; all shares add up to the whole."""
        return whole // self.of + (self.index < whole % self.of)


WHOLE = Part()
