"""Requests at a given rate whether or not they are answered, and probes next to them; each in a process of its own.

A client that waits for an answer before it asks again slows down with the service, and hides what it should show. This
one keeps to its schedule: a request is late from the moment it was due.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import random
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

WAIT = 30.0  # s for an answer


@dataclass(frozen=True, slots=True)
class Answered:
    """A request: when it was due (seconds from the start), its status (0: no answer), how long after that it came."""

    due: float
    status: int
    seconds: float


def request_of(path: str, body: bytes | None = None, key: str | None = None) -> bytes:
    """Return a request as it goes over the wire."""
    head = f"{'GET' if body is None else 'POST'} {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n"
    head += f"Authorization: Bearer {key}\r\n" if key else ""
    head += "" if body is None else "Content-Type: application/json\r\n"
    return (head + f"Content-Length: {len(body or b'')}\r\n\r\n").encode() + (body or b"")


def at_rate(port: int, requests: list[bytes], rate: float, seconds: float) -> list[Answered]:
    """Send requests by turns at random times, `rate` a second on average; return what came of each."""
    return asyncio.run(_at_rate(port, requests, rate, seconds))


def without_pause(port: int, requests: list[bytes], connections: int, seconds: float) -> list[Answered]:
    """Send a request over each connection as soon as the one before is answered."""
    return asyncio.run(_without_pause(port, requests, connections, seconds))


@contextmanager
def beside(function: Callable[..., Any], *arguments: Any) -> Iterator[Callable[[], Any]]:
    """Run a function in another process meanwhile; what is given returns its result, waiting for it."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_send, args=(theirs, function, arguments))
    process.start()
    theirs.close()
    ours.recv()  # it has started
    try:
        yield ours.recv
    finally:
        process.join()


def _send(pipe: Any, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    pipe.send(None)
    pipe.send(function(*arguments))


async def _at_rate(port: int, requests: list[bytes], rate: float, seconds: float) -> list[Answered]:
    chance = random.Random(0)
    idle: list[_Connection] = []
    every: list[_Connection] = []
    answered: list[Answered] = []
    begun = time.perf_counter()
    due, count = 0.0, 0
    while due < seconds:
        now = time.perf_counter() - begun
        if due > now:
            await asyncio.sleep(due - now)
        elif count % 64 == 0:
            await asyncio.sleep(0)  # answers are read also while this is behind its schedule
        while idle and not idle[-1].open:
            idle.pop()
        if not idle:
            idle.append(await _Connection.to(port))
            every.append(idle[-1])
        connection = idle.pop()

        def done(status: int, due: float = due, connection: _Connection = connection) -> None:
            answered.append(Answered(due, status, time.perf_counter() - begun - due))
            if connection.open:
                idle.append(connection)

        connection.ask(requests[count % len(requests)], done)
        due, count = due + chance.expovariate(rate), count + 1
    give_up = time.perf_counter() + WAIT
    while len(answered) < count and time.perf_counter() < give_up:
        await asyncio.sleep(0.01)
    for connection in every:
        connection.close()
    return answered + [Answered(seconds, 0, WAIT)] * (count - len(answered))


async def _without_pause(port: int, requests: list[bytes], connections: int, seconds: float) -> list[Answered]:
    answered: list[Answered] = []
    begun = time.perf_counter()

    async def ask(first: int) -> None:
        connection = await _Connection.to(port)
        for number in range(first, 1 << 60, connections):
            sent = time.perf_counter() - begun
            if sent > seconds:
                break
            if not connection.open:
                connection = await _Connection.to(port)
            come: asyncio.Future[int] = asyncio.get_running_loop().create_future()
            connection.ask(requests[number % len(requests)], come.set_result)
            status = await come
            answered.append(Answered(sent, status, time.perf_counter() - begun - sent))
        connection.close()

    await asyncio.gather(*(ask(number) for number in range(connections)))
    return answered


class _Connection(asyncio.Protocol):
    """One kept connection, one request at a time; as cheap as can be, since it takes time from what it measures."""

    def __init__(self) -> None:
        self.open = True
        self._transport: asyncio.Transport | None = None
        self._done: Callable[[int], None] | None = None
        self._received = b""

    @classmethod
    async def to(cls, port: int) -> _Connection:
        """Return a connection that is open."""
        _, connection = await asyncio.get_running_loop().create_connection(cls, "127.0.0.1", port)
        return connection

    def ask(self, request: bytes, done: Callable[[int], None]) -> None:
        """Send a request; `done` receives the status of the answer, 0 when there is none."""
        self._done = done
        assert self._transport is not None
        self._transport.write(request)

    def close(self) -> None:
        """Close it."""
        self.open = False
        if self._transport is not None:
            self._transport.close()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport

    def data_received(self, data: bytes) -> None:
        self._received += data
        end = self._received.find(b"\r\n\r\n")
        if end < 0:
            return
        head = self._received[:end].lower()
        _, _, length = head.partition(b"content-length: ")
        if len(self._received) < end + 4 + int(length.partition(b"\r\n")[0] or b"0"):
            return
        status, self._received = int(head[9:12]), b""
        if b"connection: close" in head:
            self.close()
        self._tell(status)

    def connection_lost(self, exc: Exception | None) -> None:
        self.open = False
        self._tell(0)

    def _tell(self, status: int) -> None:
        done, self._done = self._done, None
        if done is not None:
            done(status)
