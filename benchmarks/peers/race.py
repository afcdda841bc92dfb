"""Asking peers in processes of their own, so that one that explodes ends nothing but itself."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from registration import RigidTransform

from ..outcomes import offset
from .adapters import PEERS, Answer
from .scenes import Cell, PeerQuery

LIMIT = 1.0  # s of processor time for a query
PATIENCE = 600.0  # s that pass; for kernels to be compiled, a map to be prepared, a process that does nothing
GLANCE = 0.02  # s between two looks at what a process has used
GIVE_UP = 4  # queries of a cell out of time, from which the rest of them is not asked
DISTANCE, ANGLE = 0.3, 3.0  # m and degrees that an answer may be off
READY = "ready"
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "TBB_NUM_THREADS", "OPENCV_FOR_THREADS_NUM")


@dataclass(frozen=True, slots=True)
class Attempt:
    """The result of a peer for a query.

    Attributes
    ----------
    right : bool
        Within `DISTANCE` and `ANGLE` of the truth.
    usable : bool or None
        Its own verdict.
    ms : float
        Processor time of all its threads; the limit where it ran out.
    out_of_time : bool
    """

    right: bool
    usable: bool | None
    ms: float
    out_of_time: bool = False


class Racer:
    """A peer in a process of its own, started again when it was ended."""

    def __init__(self, key: str, limit: float = LIMIT, options: dict[str, Any] | None = None) -> None:
        self._key, self._limit, self._options = key, limit, options or {}
        self._process: Any = None
        self._line: Connection | None = None
        self._map: int | None = None
        self._told = ""

    def missing(self) -> str | None:
        """Start the process; return why it cannot be asked, None when it can."""
        return self._told if self._start() is None else None

    def ask(self, query: PeerQuery) -> tuple[Answer, float] | None:
        """Return its answer and the milliseconds that it took; None when it ran out of time or broke down."""
        line = self._line or self._start()
        if line is None:
            raise RuntimeError(self._told)
        if self._map != id(query.map):
            line.send(("map", query.map))
            self._map = id(query.map)
            if self._receive(line) is None:
                return None
            line.send(("scan", query))  # what is compiled is compiled before the first one counts
            if self._receive(line) is None:
                return None
        line.send(("scan", query))
        found: tuple[Answer, float] | None = self._receive(line, self._limit)
        return None if found is None or found[1] > 1e3 * self._limit else found

    def close(self) -> None:
        """End the process."""
        if self._line is not None:
            self._line.close()
            self._process.kill()
            self._process.join()
        self._line = self._map = None

    def _receive(self, line: Connection, limit: float = PATIENCE) -> Any:
        """Return what comes, None when the process ends first or uses up its time."""
        began = time.monotonic(), self._used()
        with contextlib.suppress(EOFError, ConnectionResetError):
            while not line.poll(GLANCE):
                if self._used() - began[1] > limit or time.monotonic() - began[0] > PATIENCE:
                    break
            else:
                return line.recv()
        self.close()
        return None

    def _used(self) -> float:
        """Return the seconds of processor time that the process has used; where the system hides it, 0."""
        try:
            return time.clock_gettime((~self._process.pid << 3) | 2)  # Linux: the clock of a process
        except (AttributeError, OSError):
            return 0.0

    def _start(self) -> Connection | None:
        os.environ.update(dict.fromkeys(THREADS, "1"))
        context = multiprocessing.get_context("spawn")
        self._line, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, self._key, self._options), daemon=True)
        self._process.start()
        theirs.close()
        self._told = self._receive(self._line) or "its process ends at once"
        if self._told != READY:
            self.close()
        return self._line


def _serve(line: Connection, key: str, options: dict[str, Any]) -> None:
    """Answer queries until the line closes."""
    try:
        peer = PEERS[key].make(**options)
    except ImportError as error:  # the package, or a library of the system that it wants
        line.send(str(error))
        return
    line.send(READY)
    prepared: Any = None
    with contextlib.suppress(EOFError):
        while True:
            what, sent = line.recv()
            if what == "map":
                prepared = peer.prepare(sent)
                line.send(True)
                continue
            start = time.process_time()
            answer = peer.locate(prepared, sent)
            spent = time.process_time() - start
            line.send((answer, 1e3 * spent))


def is_right(answer: Answer, truth: RigidTransform) -> bool:
    """Tell whether an answer is near enough to the truth."""
    if answer.pose is None or not np.isfinite(answer.pose).all():
        return False
    distance, angle = offset(RigidTransform(*answer.pose), truth)
    return distance < DISTANCE and angle < ANGLE


def attempts(racer: Racer, cell: Cell, limit: float = LIMIT) -> Iterator[Attempt]:
    """Ask all queries of a cell, or until too many ran out of time."""
    lost = 0
    for query in cell.queries:
        found = racer.ask(query)
        if found is None:
            lost += 1
            yield Attempt(False, None, 1e3 * limit, out_of_time=True)
            if lost == GIVE_UP:
                return
            continue
        answer, ms = found
        yield Attempt(is_right(answer, query.pose), answer.usable, ms)
