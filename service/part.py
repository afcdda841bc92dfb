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
        True when it replaces a process that has died.
    """

    index: int = 0
    of: int = 1
    replaces: bool = False

    @property
    def is_first(self) -> bool:
        """Return whether it may make the objects that exist once; the other processes use the existing ones."""
        return self.index == 0 and not self.replaces

    @property
    def opens_late(self) -> bool:
        """Return whether it opens its port only when ready: others serve meanwhile, or the first reports why not.

        A service is ready as soon as one of its processes is. No other may take a request that it has to refuse.
        """
        return not self.is_first

    def share(self, whole: int) -> int:
        """Return this part's share of something; all shares add up to the whole."""
        return whole // self.of + (self.index < whole % self.of)


WHOLE = Part()
