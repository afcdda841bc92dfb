"""The queue for slots, shared fairly between keys."""

from __future__ import annotations

import asyncio
from collections import Counter, deque
from collections.abc import Callable

Holder = bytes | None
"""Whose request it is: the digest of a key, or an address where the service has no keys; None where unknown."""

Waiter = asyncio.Future[None]
"""A request that waits for a slot: done when it gets one, or when it is refused."""


class FairQueue:
    """Waiting requests, one line per holder; the holder that has used the least time is served first.

    A holder counts as active while it has something waiting, running or on its way. A new one starts where the least
    served of the active ones is. It neither pays for old use nor has credit from the time it was away.
    """

    def __init__(self) -> None:
        self._lines: dict[Holder, deque[Waiter]] = {}
        self._running: Counter[Holder] = Counter()
        self._coming: Counter[Holder] = Counter()
        self._used: dict[Holder, float] = {}
        self._fixed: set[Waiter] = set()
        self.waiting = 0

    @property
    def holders(self) -> int:
        """The number of active holders."""
        return len(self._used)

    def places_of(self, holder: Holder) -> int:
        """Return how many requests of a holder wait, run, or are on their way."""
        return len(self._lines.get(holder, ())) + self._running[holder] + self._coming[holder]

    def expect(self, holder: Holder) -> None:
        """Note that something of a holder is on its way."""
        self._activate(holder)
        self._coming[holder] += 1

    def expect_no_longer(self, holder: Holder) -> None:
        """Note that it has come, or will not."""
        self._coming[holder] -= 1
        self._forget_idle(holder)

    def join(self, holder: Holder, *, fixed: bool) -> Waiter:
        """Add a request to the end of the holder's line and return it; a fixed one is never refused later."""
        self._activate(holder)
        waiter: Waiter = asyncio.get_running_loop().create_future()
        self._lines.setdefault(holder, deque()).append(waiter)
        self.waiting += 1
        if fixed:
            self._fixed.add(waiter)
        return waiter

    def leave(self, holder: Holder, waiter: Waiter) -> None:
        """Remove a request that still waits."""
        self._lines[holder].remove(waiter)
        self._left(holder, waiter)

    def next(self, may_start: Callable[[Holder], bool]) -> Waiter | None:
        """Remove the next request and count it as running; None when no holder waits that may start something."""
        waiting = [holder for holder, line in self._lines.items() if line and may_start(holder)]
        if not waiting:
            return None
        # Of equals the one that has stood in front for longest: lines are kept in the order in which they began.
        holder = min(waiting, key=self._used.__getitem__)
        waiter = self._lines[holder].popleft()
        self.started(holder)
        self._left(holder, waiter)
        return waiter

    def take_from_the_greediest(self, share: float) -> Waiter | None:
        """Remove the youngest request of the holder with the most places, if these are more than a share."""
        lines = [(self.places_of(holder), holder) for holder, line in self._lines.items() if set(line) - self._fixed]
        places, greediest = max(lines, key=lambda item: item[0], default=(0, None))
        if places <= share:
            return None
        waiter = next(waiter for waiter in reversed(self._lines[greediest]) if waiter not in self._fixed)
        self.leave(greediest, waiter)
        return waiter

    def started(self, holder: Holder) -> None:
        """Note that something of a holder runs."""
        self._activate(holder)
        self._running[holder] += 1

    def spent(self, holder: Holder, seconds: float) -> None:
        """Note that something of a holder has used a slot for so long, and runs on without one."""
        self._used[holder] += seconds

    def finished(self, holder: Holder, seconds: float) -> None:
        """Note that something has ended, which has used a slot for so long since the last note."""
        self._running[holder] -= 1
        self._used[holder] += seconds
        self._forget_idle(holder)

    def _left(self, holder: Holder, waiter: Waiter) -> None:
        self._fixed.discard(waiter)
        self.waiting -= 1
        line = self._lines.pop(holder)
        if line:
            self._lines[holder] = line
        self._forget_idle(holder)

    def _activate(self, holder: Holder) -> None:
        if holder not in self._used:
            self._used[holder] = min(self._used.values(), default=0.0)

    def _forget_idle(self, holder: Holder) -> None:
        if not self.places_of(holder):
            del self._used[holder], self._running[holder], self._coming[holder]
