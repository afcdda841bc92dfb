"""Memory that requests may take while they are read."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from .errors import TooMuchHeldError


class ByteBudget:
    """Knows how many bytes of all requests are held.

    Parameters
    ----------
    most : int
        Bytes that may be held at once.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self.held = 0

    @contextmanager
    def account(self) -> Iterator[ByteAccount]:
        """Give an account to one request; what it took is given back when the block ends."""
        account = ByteAccount(self)
        try:
            yield account
        finally:
            self.held -= account.taken

    def fits(self, count: int) -> bool:
        """Tell whether so many more may be held."""
        return self.held + count <= self._most


class ByteAccount:
    """What one request holds of the budget."""

    def __init__(self, budget: ByteBudget) -> None:
        self._budget = budget
        self.taken = 0

    def take(self, count: int) -> None:
        """Count more bytes as held.

        Raises
        ------
        TooMuchHeldError
            When all requests together would hold too many; nothing is counted then.
        """
        if not self._budget.fits(count):
            raise TooMuchHeldError
        self._budget.held += count
        self.taken += count
