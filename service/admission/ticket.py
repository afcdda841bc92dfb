"""The decision about a request, and its place on the way to a search."""

from __future__ import annotations

from typing import Protocol

from .fair_queue import Holder


class Expecting(Protocol):
    """A gate that expects requests."""

    def expect(self, holder: Holder) -> None:
        """Note that a request is on its way, its body complete."""

    def expect_no_longer(self, holder: Holder) -> None:
        """Note that it has come, or never will."""


class Ticket:
    """One request's admission; made by `Entrance.admit`, taken by `Gate.run`.

    From the end of its body until it reaches the gate, a request that is to search counts as taking a place. Without
    that, requests that arrive together would all see the same free place.

    Parameters
    ----------
    holder : Holder
        The key or the address that the request comes from.
    gate : Expecting, or None
        The gate that it is on its way to; None for a request that does not search.
    maps : str
        Prefix of the ids of the maps that exist for it.

    Attributes
    ----------
    admitted : bool
        True when it has had a slot: an admitted request is not refused later.
    """

    __slots__ = ("_announced", "_gate", "admitted", "holder", "maps")

    def __init__(self, holder: Holder = None, gate: Expecting | None = None, maps: str = "") -> None:
        self.holder = holder
        self.maps = maps
        self.admitted = False
        self._gate = gate
        self._announced = False

    def announce(self) -> None:
        """Announce to the gate that the body is there and the request on its way."""
        if self._gate is not None and not self._announced:
            self._announced = True
            self._gate.expect(self.holder)

    def arrive(self) -> None:
        """Note that the request is at the gate, or will never come; it is not announced again."""
        gate, self._gate = self._gate, None
        if gate is not None and self._announced:
            gate.expect_no_longer(self.holder)
