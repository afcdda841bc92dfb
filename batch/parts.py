"""The results of a run so far, in a folder next to the output: a run that was killed continues from them."""

from __future__ import annotations

import json
import os
import re
import shutil
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import pyarrow as pa
import pyarrow.parquet as pq
from filelock import FileLock, Timeout

from .blocks import Block
from .errors import OtherRunError
from .tables import POSES

_NAME = re.compile(r"(\d+)-(\d+)-(\d+)\.parquet")
ROWS = 65_536  # of a row group of the output


@dataclass(frozen=True, slots=True)
class Parts:
    """The rows of each block in a file of its own, named after it.

    A block that is done twice writes the same file twice: each scan has its row exactly once.
    """

    folder: Path

    @property
    def scans(self) -> Path:
        """Folder of the logs that are laid out as Parquet files."""
        return self.folder / "scans"

    @property
    def poses(self) -> Path:
        """Folder of the rows."""
        return self.folder / "poses"

    def keep(self, block: Block, rows: pa.Table) -> None:
        """Write the rows of a block; they outlive a kill and a power loss from then on."""
        with whole(self._path(block.number, block.start, block.stop)) as file:
            pq.write_table(rows, file)

    def left(self, blocks: list[Block]) -> list[Block]:
        """Return what of the blocks is not done."""
        done = defaultdict(set)
        for number, start, stop in self._kept():
            done[number].add((start, stop))
        return [one for block in blocks for one in _left(block, done[block.number])]

    def assemble(self, out: Path) -> Iterator[pa.Table]:
        """Write the rows in the order of logs and scans, then remove the parts; yield them on the way."""
        with whole(out) as file, pq.ParquetWriter(file, POSES) as writer:
            gathered: list[pa.Table] = []
            for kept in self._kept():
                gathered.append(pq.read_table(self._path(*kept)))
                yield gathered[-1]
                if sum(map(len, gathered)) >= ROWS:
                    writer.write_table(pa.concat_tables(gathered))
                    gathered.clear()
            if gathered:
                writer.write_table(pa.concat_tables(gathered))
        shutil.rmtree(self.folder)

    def _path(self, number: int, start: int, stop: int) -> Path:
        return self.poses / f"{number:06d}-{start:012d}-{stop:012d}.parquet"

    def _kept(self) -> list[tuple[int, int, int]]:
        found = (_NAME.fullmatch(path.name) for path in self.poses.iterdir())
        return sorted((int(m[1]), int(m[2]), int(m[3])) for m in found if m is not None)


def _left(block: Block, done: set[tuple[int, int]]) -> list[Block]:
    if (block.start, block.stop) in done:
        return []
    if any(block.start <= start and stop <= block.stop for start, stop in done):
        return [one for half in block.halves for one in _left(half, done)]
    return [block]


@contextmanager
def whole(path: Path) -> Iterator[BinaryIO]:
    """Give a file to write; it has its name, and outlives a kill and a power loss, once all of it is written."""
    begun = path.with_name(path.name + ".begun")
    with begun.open("wb") as file:
        yield file
        file.flush()
        os.fsync(file.fileno())
    begun.replace(path)


@contextmanager
def opened(out: Path, told: dict[str, Any]) -> Iterator[Parts]:
    """Open the parts of an output, for one run at a time.

    Parameters
    ----------
    out : Path
    told : dict
        The values that make two runs the same; can be JSON.

    Raises
    ------
    OtherRunError
        When a run is at work on it, or an unfinished one had other logs, maps or options.
    """
    parts = Parts(out.with_name(out.name + ".parts"))
    for folder in (parts.scans, parts.poses):
        folder.mkdir(parents=True, exist_ok=True)
    lock = FileLock(parts.folder / "lock")
    try:
        lock.acquire(timeout=0)
    except Timeout:
        raise OtherRunError(
            "another run writes to it; wait until that run ends, or name another output", argument=str(out)
        ) from None
    try:
        plan = parts.folder / "run.json"
        if not plan.exists():
            with whole(plan) as file:
                file.write(json.dumps(told).encode())
        elif json.loads(plan.read_text()) != json.loads(json.dumps(told)):
            raise OtherRunError(
                "an unfinished run of other logs, maps or options lies there; go on with those, or remove the folder",
                argument=str(parts.folder),
            )
        yield parts
    finally:
        lock.release()
