"""The maps that are searched; and an OccupancyGrid to a map, in a process of its own: bounded in time and memory.

The process is started before the first grid comes, because loading the code takes some seconds, and ends when no grid
has come for a while.
"""

from __future__ import annotations

import contextlib
import hashlib
import multiprocessing
import os
import pickle
import signal
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from typing import Any, Literal

import numpy as np
from scipy.spatial import cKDTree

import linefix

from .messages import Header, MapMetaData, OccupancyGrid, SerializedGrid
from .options import MAX_NAME
from .tuning import CONVERSION_BYTES, CONVERSION_IDLE, CONVERSION_PATIENCE, CONVERSION_SECONDS, MAX_GRID_BYTES

SAME = 0.1  # m; two cells of most grids: a wall that is nearer is the same one
UNNAMED = ""  # the name of a map that came over a topic


@dataclass(frozen=True, slots=True, eq=False)
class Maps:
    """One map, or several that are searched together.

    Attributes
    ----------
    index : MapIndex or MapSet
    frames : mapping of str to str
        The frame of each map by its name, in the order of the index; `UNNAMED` from a topic.
    """

    index: linefix.MapIndex | linefix.MapSet
    frames: Mapping[str, str]

    @property
    def several(self) -> bool:
        """Return whether an answer names its map."""
        return isinstance(self.index, linefix.MapSet)

    def name_of(self, map_id: str | None) -> str:
        """Return the name of the map of an answer; `map_id` is None for a single map."""
        return next(iter(self.frames)) if map_id is None else map_id

    def frame_of(self, map_id: str | None) -> str:
        """Return the frame of the map of an answer."""
        return self.frames[self.name_of(map_id)]

    def walls_of(self, map_id: str | None) -> linefix.Segments:
        """Return the segments of the map of an answer, in its frame."""
        if isinstance(self.index, linefix.MapSet):
            return self.index.parts[self.index.ids.index(self.name_of(map_id))].segments
        return self.index.segments.take(np.arange(self.index.directed))

    def similarity(self, before: Maps | None) -> float:
        """Return which fraction of the walls is where walls were before, or the other way round; the lesser one."""
        if before is None or self.several or before.several or [*self.frames.values()] != [*before.frames.values()]:
            return 0.0
        mine, theirs = (one.walls_of(None).points(SAME) for one in (self, before))
        return float(min(np.mean(cKDTree(b).query(a)[0] <= SAME) for a, b in ((mine, theirs), (theirs, mine))))


@dataclass(frozen=True, slots=True, eq=False)
class Converted:
    """The result of a conversion.

    Attributes
    ----------
    maps : Maps or None
        None where the grid is not used.
    size : str
        Of the grid, to be logged.
    problem : str
        Why the grid is not used.
    """

    maps: Maps | None = None
    size: str = ""
    problem: str = ""


class MapConverter:
    """Converts the newest grid in the background.

    Parameters
    ----------
    done : callable
        Called in another thread when a result can be taken.
    surface : float, optional
        As of `NodeOptions`.
    """

    def __init__(self, done: Callable[[], None], surface: float | None = None) -> None:
        self._done, self._surface = done, surface
        self._digest = b""
        self._next: bytes | None = None  # the grid that is converted next
        self._work: Future[Converted] | None = None
        self._process: _Process | None = None
        self._used = time.monotonic()
        self._ended = False
        self._starting = threading.Lock()  # no process starts after the end
        self._pool = ThreadPoolExecutor(1, "map conversion")
        self.ready = self._pool.submit(self._answer, b"")  # starts the process, which loads the code

    @property
    def busy(self) -> bool:
        """Return whether a result is still to be taken."""
        return self._work is not None

    def take(self, grid: SerializedGrid) -> None:
        """Convert a grid, unless it is the one that was converted last; a grid that still waits is left out."""
        digest = digest_of(grid.serialized)
        if digest != self._digest:
            self._digest, self._next = digest, grid.serialized
            self._begin()

    def _begin(self) -> None:
        if self._work is None and self._next is not None:
            self._work, self._next = self._pool.submit(self._convert, self._next), None
            self._work.add_done_callback(lambda _: self._done())

    def result(self) -> Converted | None:
        """Return the result of the last conversion once, None where there is none."""
        if self._work is not None and self._work.done():
            found, self._work, self._used = self._work.result(), None, time.monotonic()
            self._begin()
            return found
        if self._work is None and self.ready.done() and time.monotonic() - self._used > CONVERSION_IDLE:
            self._stop()
        return None

    def end(self, seconds: float) -> bool:
        """Stop converting, and return whether thread and process have ended within a time."""
        with self._starting:
            self._ended = True
            if self._process is not None:
                self._process.kill()
        self._pool.shutdown(wait=False)
        works: list[Future[Any]] = [one for one in (self.ready, self._work) if one is not None]
        if wait(works, seconds).not_done:
            return False
        self._stop()
        return True

    def _convert(self, grid: bytes) -> Converted:
        if len(grid) > MAX_GRID_BYTES:
            return Converted(problem=f"found {len(grid)} bytes, expected at most {MAX_GRID_BYTES}")
        converted = self._answer(grid)
        if converted is None:
            self._stop()
            return Converted(
                problem=f"its conversion takes more than {CONVERSION_SECONDS:g} s of a core or 4 GB, as noise does; "
                "look at the map, or convert it with `linefix map import` and pass it with --map"
            )
        return converted

    def _answer(self, grid: bytes) -> Converted | None:
        """Return what the process makes of a grid; None where it ended, or takes too long."""
        with self._starting:
            if self._ended:
                return None
            if self._process is None or not self._process.is_alive():
                self._process = _Process(self._surface)
        return self._process.convert(grid)

    def _stop(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.join()
            process.connection.close()


class _Process(SpawnProcess):
    """The process that converts."""

    def __init__(self, surface: float | None) -> None:
        self.connection, theirs = multiprocessing.Pipe()
        super().__init__(target=_serve, args=(theirs, surface), name="map conversion", daemon=True)
        self.start()
        theirs.close()

    def convert(self, grid: bytes) -> Converted | None:
        with contextlib.suppress(OSError, EOFError):
            self.connection.send_bytes(grid)
            if self.connection.poll(CONVERSION_PATIENCE):
                converted: Converted = pickle.loads(self.connection.recv_bytes())
                return converted
        return None


def convert(serialized: bytes, surface: float | None = None) -> Converted:
    """Return the map of a serialized OccupancyGrid."""
    from formats import map_of_grid

    try:
        grid = OccupancyGrid.deserialize(serialized)
    except Exception as error:  # whatever decoding raises for bytes that are no such message
        return Converted(problem=f"its message cannot be decoded: {error}")
    frame = grid.header.frame_id.strip("/")
    if not frame or len(frame) > MAX_NAME:
        return Converted(problem=f"its frame_id has {len(frame)} characters, expected 1 to {MAX_NAME}, such as map")
    try:
        index = linefix.index_map(map_of_grid(grid, surface=surface))
    except linefix.InputError as error:
        return Converted(problem=str(error))
    size = f"{grid.info.width} x {grid.info.height} cells of {grid.info.resolution:.3g} m"
    return Converted(Maps(index, {UNNAMED: frame}), size)


def digest_of(serialized: bytes) -> bytes:
    """Return a digest of a serialized grid without its stamps: they change when the map is published again."""
    order: Literal["little", "big"] = "little" if serialized[1:2] == b"\x01" else "big"
    name = 4 + 8  # after the header of the encoding, and the stamp
    end = name + 4 + int.from_bytes(serialized[name : name + 4], order)
    end += -end % 4
    digest = hashlib.sha256(serialized[name:end])
    digest.update(serialized[end + 8 :])  # without the load time
    return digest.digest()


def _serve(connection: Connection[Any, Any], surface: float | None) -> None:
    """Convert grids until the other process has gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # an interrupt at a terminal goes to all processes there
    _limit("RLIMIT_AS", CONVERSION_BYTES)
    convert(_small_grid())  # loads the compiled code
    with contextlib.suppress(EOFError, OSError):
        while True:
            grid = connection.recv_bytes(MAX_GRID_BYTES)
            used = os.times()
            _limit("RLIMIT_CPU", int(used.user + used.system + CONVERSION_SECONDS) + 1)
            connection.send_bytes(pickle.dumps(convert(grid, surface) if grid else Converted()))


def _small_grid() -> bytes:
    cells = np.full((40, 60), -1, dtype=np.int8)
    cells[5:35, 5:55] = 100
    cells[6:34, 6:54] = 0
    info = MapMetaData(resolution=0.1, width=60, height=40)
    return bytes(OccupancyGrid(Header(frame_id="map"), info, cells.ravel().tolist()).serialize())


def _limit(what: Literal["RLIMIT_AS", "RLIMIT_CPU"], most: int) -> None:
    with contextlib.suppress(ImportError, ValueError, OSError):  # not on every system
        import resource

        resource.setrlimit(getattr(resource, what), (most, resource.RLIM_INFINITY))
