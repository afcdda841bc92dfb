"""Memory that requests or answers may take: a limit for all together and one for each caller."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

from ..errors import ShareHeldError, TooMuchHeldError
from .keys import Holder


class ByteBudget:
    """Counts the bytes that are held; safe to use from several threads.

    No holder has more than half: the others have room even while one withholds its part for as long as it may. The
    largest piece, `least_share`, always fits where there is room.
    """

    def __init__(self, most: int, least_share: int = 0) -> None:
        self.most = most
        self.share = max(most // 2, least_share)
        self.lock = threading.Lock()
        self.held_by: Counter[Holder] = Counter()
        self.held = 0

    @contextmanager
    def account(self, holder: Holder = None) -> Iterator[ByteAccount]:
        """Give the account of one request; its bytes are given back when the block ends."""
        account = ByteAccount(self, holder)
        try:
            yield account
        finally:
            account.take(-account.taken)


class ByteAccount:
    """The bytes that one request holds of the budget."""

    def __init__(self, budget: ByteBudget, holder: Holder) -> None:
        self._budget = budget
        self._holder = holder
        self.taken = 0

    def take(self, count: int) -> None:
        """Count more bytes as held; negative ones are given back.

        Raises
        ------
        ShareHeldError
            When the holder would have more than its share.
        TooMuchHeldError
            When all together would hold too many.
        """
        budget = self._budget
        with budget.lock:
            if count > 0 and budget.held_by[self._holder] + count > budget.share:
                raise ShareHeldError
            if count > 0 and budget.held + count > budget.most:
                raise TooMuchHeldError
            budget.held += count
            budget.held_by[self._holder] += count
            self.taken += count
            if not budget.held_by[self._holder]:
                del budget.held_by[self._holder]
