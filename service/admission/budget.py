"""Memory that requests or answers may take: a limit for all together and one for each caller."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ..errors import ShareHeldError, TooMuchHeldError
from .keys import Holder

Take = Callable[[int], None]
"""Counts more bytes of one request as held; negative ones are given back. Raises `ShareHeldError`, `TooMuchHeldError`.
"""


class ByteBudget:
    """Counts the bytes that are held; safe to use from several threads.

    No holder has more than half: the others have room even while one withholds its part for as long as it may. The
    largest piece, `least_share`, always fits where there is room.
    """

    def __init__(self, most: int, least_share: int = 0) -> None:
        self._most = most
        self._share = max(most // 2, least_share)
        self._lock = threading.Lock()
        self._held_by: Counter[Holder] = Counter()
        self.held = 0

    @contextmanager
    def account(self, holder: Holder = None) -> Iterator[Take]:
        """Give the function that counts the bytes of one request; they are given back when the block ends."""
        taken = 0

        def take(count: int) -> None:
            nonlocal taken
            with self._lock:
                if count > 0 and self._held_by[holder] + count > self._share:
                    raise ShareHeldError
                if count > 0 and self.held + count > self._most:
                    raise TooMuchHeldError
                taken += count
                self.held += count
                self._held_by[holder] += count
                if not self._held_by[holder]:
                    del self._held_by[holder]

        try:
            yield take
        finally:
            take(-taken)
