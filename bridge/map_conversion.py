"""An OccupancyGrid to a map that can be searched, in a process of its own: bounded in time and memory.

The process reads a serialized message from stdin and writes a pickled `Converted` to stdout (`main`).
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import linefix

from .messages import OccupancyGrid, SerializedGrid
from .text import MAX_NAME
from .tuning import CONVERSION_BYTES, CONVERSION_PATIENCE, CONVERSION_SECONDS, MAX_GRID_BYTES


@dataclass(frozen=True, slots=True, eq=False)
class Converted:
    """The result of a conversion.

    Attributes
    ----------
    index : MapIndex or None
        None where the grid is not used.
    frame : str
        Of the map.
    size : str
        Of the grid, to be logged.
    problem : str
        Why the grid is not used.
    """

    index: linefix.MapIndex | None = None
    frame: str = "map"
    size: str = ""
    problem: str = ""


class MapConverter:
    """Converts the newest grid in the background.

    Parameters
    ----------
    done : callable
        Called in another thread when a result can be taken.
    """

    def __init__(self, done: Callable[[], None]) -> None:
        self._done = done
        self._lock = threading.Lock()
        self._waiting: bytes | None = None
        self._result: Converted | None = None
        self._digest = b""
        self._process: subprocess.Popen[bytes] | None = None
        self._running = self._ended = False

    def take(self, grid: SerializedGrid) -> None:
        """Convert a grid, unless it is the one that was converted last; a grid that still waits is replaced."""
        digest = _digest_of(grid.serialized)
        with self._lock:
            if digest == self._digest or self._ended:
                return
            self._digest, self._waiting = digest, grid.serialized
            if self._running:
                return
            self._running = True
        threading.Thread(target=self._run, name="map conversion", daemon=True).start()

    @property
    def busy(self) -> bool:
        """Whether a grid is being converted."""
        return self._running

    def result(self) -> Converted | None:
        """Return the result of the last conversion once, None where there is none."""
        with self._lock:
            found, self._result = self._result, None
        return found

    def end(self) -> None:
        """Stop converting."""
        with self._lock:
            self._ended, self._waiting = True, None
            if self._process is not None:
                self._process.kill()

    def _run(self) -> None:
        while True:
            with self._lock:
                serialized, self._waiting = self._waiting, None
                if serialized is None:
                    self._running = False
                    return
            converted = self._convert(serialized)
            with self._lock:
                self._result = converted
            self._done()

    def _convert(self, serialized: bytes) -> Converted:
        if len(serialized) > MAX_GRID_BYTES:
            return Converted(problem=f"found {len(serialized)} bytes, expected at most {MAX_GRID_BYTES}")
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(one for one in sys.path if one)}
        command = [sys.executable, "-c", f"from {__name__} import main; main()"]
        with self._lock:
            if self._ended:
                return Converted(problem="linefix is ending")
            self._process = subprocess.Popen(
                command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
            )
        try:
            written, _ = self._process.communicate(serialized, timeout=CONVERSION_PATIENCE)
            if self._process.returncode == 0:
                converted: Converted = pickle.loads(written)  # of our own process
                return converted
        except subprocess.TimeoutExpired:
            pass
        finally:
            self._process.kill()
            self._process.communicate()
        return Converted(
            problem=f"its conversion takes more than {CONVERSION_SECONDS:g} s of a core or 4 GB, as noise does; "
            "look at the map, or convert it with `linefix map import` and pass it with --map"
        )


def convert(serialized: bytes) -> Converted:
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
        index = linefix.index_map(map_of_grid(grid))
    except linefix.InputError as error:
        return Converted(problem=str(error))
    size = f"{grid.info.width} x {grid.info.height} cells of {grid.info.resolution:g} m"
    return Converted(index, frame, size)


def _digest_of(serialized: bytes) -> bytes:
    """Return a digest of a serialized grid without its stamps: they change when the map is published again."""
    order: Literal["little", "big"] = "little" if serialized[1:2] == b"\x01" else "big"
    name = 4 + 8  # after the header of the encoding, and the stamp
    end = name + 4 + int.from_bytes(serialized[name : name + 4], order)
    end += -end % 4
    digest = hashlib.sha256(serialized[name:end])
    digest.update(serialized[end + 8 :])  # without the load time
    return digest.digest()


def _limit() -> None:
    with contextlib.suppress(ImportError, ValueError, OSError):  # not on every system
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (CONVERSION_BYTES, CONVERSION_BYTES))
        seconds = int(CONVERSION_SECONDS)
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))


def main() -> None:
    """Convert the message on stdin."""
    _limit()
    sys.stdout.buffer.write(pickle.dumps(convert(sys.stdin.buffer.read())))
