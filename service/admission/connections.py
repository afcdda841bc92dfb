"""Who may keep a connection open: a bounded number of all, half of it of one address."""

from __future__ import annotations

import resource
from collections import Counter
from enum import IntEnum
from typing import Protocol

from .fair_queue import Holder

RESERVED = 96  # descriptors for everything else: databases, the parser's pipes, files that are being loaded
FEWEST = 8


class Use(IntEnum):
    """What a connection is good for at the moment; the less, the sooner it is given up."""

    IDLE = 0
    RECEIVING = 1
    SENDING = 2
    BUSY = 3


class Connection(Protocol):
    """A connection that can be given up."""

    @property
    def use(self) -> Use:
        """What it is good for at the moment."""

    def give_up(self) -> None:
        """End it now."""


class ConnectionLimit:
    """Counts connections, and gives up the least useful where there are too many; belongs to one event loop.

    A new one is always let in while another is not at work: whoever keeps them open without a use only takes them from
    itself, as long as another address has fewer.

    Parameters
    ----------
    most : int
        That are open at once.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._share = max(1, most // 2)
        self._open: dict[Connection, Holder] = {}  # in the order in which they were last used
        self._counts: Counter[Holder] = Counter()

    def __len__(self) -> int:
        return len(self._open)

    def add(self, connection: Connection, address: Holder) -> bool:
        """Count a new connection; False when there is no place for it."""
        if self._counts[address] >= self._share:
            left = self._give_up_one_of(address)
        elif len(self._open) >= self._most:
            left = self._give_up_one_of(max(self._counts, key=self._counts.__getitem__))
        else:
            left = True
        if left:
            self._open[connection] = address
            self._counts[address] += 1
        return left

    def remove(self, connection: Connection) -> None:
        """Count one no longer; it may have gone before."""
        if connection in self._open:
            address = self._open.pop(connection)
            self._counts[address] -= 1
            if not self._counts[address]:
                del self._counts[address]

    def used(self, connection: Connection) -> None:
        """Note that a request begins on a connection: of equally useless ones it is given up last."""
        if connection in self._open:
            self._open[connection] = self._open.pop(connection)

    def _give_up_one_of(self, address: Holder) -> bool:
        """Give up the least useful connection of an address that is not at work; False when all are."""
        its = [(connection.use, connection) for connection, owner in self._open.items() if owner == address]
        use, least = min(its, key=lambda item: item[0])
        if use is Use.BUSY:
            return False
        self.remove(least)
        least.give_up()
        return True


def most_connections(wanted: int) -> int:
    """Return how many of the wanted connections there are descriptors for; first as many are asked for.

    Past the system's limit not even a file can be opened: the store would seem to be read-only.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    needed = wanted + RESERVED
    if soft != resource.RLIM_INFINITY and soft < needed:
        soft = needed if hard == resource.RLIM_INFINITY else min(needed, hard)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        return max(FEWEST, min(wanted, soft - RESERVED))
    return wanted
