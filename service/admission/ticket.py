"""What was decided about a request, and its place on the way to a search."""

from __future__ import annotations

from typing import Protocol

from .errors import AdmissionError
from .fair_queue import Holder


class Expecting(Protocol):
    """Where requests are expected: the gate."""

    def expect(self, holder: Holder) -> None:
        """Note that a request is on its way, its body complete."""

    def expect_no_longer(self, holder: Holder) -> None:
        """Note that it has come, or never will."""


class Ticket:
    """One request's admission; made by `Entrance.admit`, taken by `SearchGate.run`.

    Between the end of its body and the gate a request that is to search has a place that counts: without it all that
    come together would find room.

    Parameters
    ----------
    holder : Holder
        Whose key it came with.
    gate : Expecting, or None
        Where it is on its way to; None for what does not search.
    key_error : type of AdmissionError, or None
        What is wrong with its key, for routes that ask for one. The type alone: an exception that was raised would keep
        everything that led to it.

    Attributes
    ----------
    admitted : bool
        Whether it has had a turn: what was let in once is not sent away later.
    """

    __slots__ = ("_announced", "_gate", "admitted", "holder", "key_error")

    def __init__(
        self, holder: Holder = None, gate: Expecting | None = None, key_error: type[AdmissionError] | None = None
    ) -> None:
        self.holder = holder
        self.key_error = key_error
        self.admitted = False
        self._gate = gate
        self._announced = False

    def require_key(self) -> None:
        """Raise what is wrong with the key, if anything is."""
        if self.key_error is not None:
            raise self.key_error

    def announce(self) -> None:
        """Say that the body is there and the request on its way to the gate."""
        if self._gate is not None and not self._announced:
            self._announced = True
            self._gate.expect(self.holder)

    def arrive(self) -> None:
        """Say that the request is at the gate, or will never come; it is not announced again."""
        gate, self._gate = self._gate, None
        if gate is not None and self._announced:
            gate.expect_no_longer(self.holder)
