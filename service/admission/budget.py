"""Memory that requests or answers may take: a limit for all together and one for each caller."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

from .errors import ShareHeldError, TooMuchHeldError
from .fair_queue import Holder


class ByteBudget:
    """Counts the bytes that are held; safe to use from several threads.

    No holder has more than half: the others have room even while one withholds its part for as long as it may.

    Parameters
    ----------
    most : int
        Bytes that may be held at once.
    least_share : int
        That one holder may always have, if there is room: the largest that comes in one piece.
    """

    def __init__(self, most: int, least_share: int = 0) -> None:
        self._most = most
        self._share = max(most // 2, least_share)
        self._lock = threading.Lock()
        self._held_by: Counter[Holder] = Counter()
        self.held = 0

    @contextmanager
    def account(self, holder: Holder = None) -> Iterator[ByteAccount]:
        """Give an account to one request; its bytes are given back when the block ends."""
        account = ByteAccount(self, holder)
        try:
            yield account
        finally:
            account.give_back(account.taken)

    def take(self, holder: Holder, count: int) -> None:
        """Count more bytes as held.

        Raises
        ------
        ShareHeldError
            When the holder would have more than its share.
        TooMuchHeldError
            When all together would hold too many.
        """
        with self._lock:
            if self._held_by[holder] + count > self._share:
                raise ShareHeldError
            if self.held + count > self._most:
                raise TooMuchHeldError
            self.held += count
            self._held_by[holder] += count

    def give_back(self, holder: Holder, count: int) -> None:
        """Count bytes as held no longer."""
        with self._lock:
            self.held -= count
            self._held_by[holder] -= count
            if not self._held_by[holder]:
                del self._held_by[holder]


class ByteAccount:
    """The bytes that one request holds of the budget."""

    def __init__(self, budget: ByteBudget, holder: Holder) -> None:
        self._budget = budget
        self._holder = holder
        self.taken = 0

    def take(self, count: int) -> None:
        """Count more bytes as held; raises what `ByteBudget.take` raises, and then counts nothing."""
        self._budget.take(self._holder, count)
        self.taken += count

    def give_back(self, count: int) -> None:
        """Count bytes as held no longer."""
        self._budget.give_back(self._holder, count)
        self.taken -= count
