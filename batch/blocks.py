"""Blocks: the scans that a worker does at a time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from .errors import UnreadableScansError
from .tables import BOUNDS, COLUMNS, LASER, MOTION

Json = dict[str, Any]
FARTHEST = 1e4  # m; what is farther is no return
ORIGIN = {"x": 0.0, "y": 0.0, "theta": 0.0}


@dataclass(frozen=True, slots=True)
class Block:
    """Some consecutive scans of a log.

    Attributes
    ----------
    number : int
        Of the log, in the order in which they were named.
    log : str
        As the caller named it.
    path : str
        The Parquet file that holds its scans.
    start, stop : int
        Scans from the one up to the other.
    """

    number: int
    log: str
    path: str
    start: int
    stop: int

    def __len__(self) -> int:
        return self.stop - self.start

    @property
    def halves(self) -> tuple[Block, Block]:
        """The block in two; of at least two scans."""
        middle = (self.start + self.stop) // 2
        return replace(self, stop=middle), replace(self, start=middle)


def scan_document(row: Json) -> Json:
    """Return the `scan` of a request for a row; raises `UnreadableScansError` where there is none."""
    values = {name: value for name, value in row.items() if value is not None}
    if "error" in values:
        raise UnreadableScansError(values["error"], argument="log")
    sigma = {"sigma": values["sigma"]} if "sigma" in values else {}
    if "ranges" not in values:
        if "segments" not in values:
            raise UnreadableScansError("expected ranges or segments, found neither", argument="scan")
        return {"segments": values["segments"], **sigma}
    laser = {name: values[name] for name in (*LASER, *BOUNDS, *MOTION[:1]) if name in values}
    laser["range_max"] = most = min(laser.get("range_max", FARTHEST), FARTHEST)
    laser["ranges"] = np.clip(laser["ranges"], -1.0, 2.0 * most)  # a request has no infinity
    twist = {name: values[name] for name in MOTION[1:] if name in values}
    motion = {"twist": twist} if len(twist) == len(MOTION[1:]) and laser.get(MOTION[0]) else {}
    view = {"laser": laser, "pose": ORIGIN, "flipped": values.get("flipped", False)}
    return {"views": [{**view, **sigma, **motion}]}


def rows_of(block: Block) -> Iterator[Json]:
    """Yield the scans of a block, each as its row; `ranges` as an array."""
    table = _read(block)
    ranges = table.column("ranges") if "ranges" in table.column_names else pa.nulls(len(table))
    rest = table.select([name for name in table.column_names if name != "ranges"]).to_pylist()
    for row, one in zip(rest or [{} for _ in ranges], ranges, strict=True):
        if one.is_valid:
            row["ranges"] = one.values.to_numpy(zero_copy_only=False).astype(np.float64, copy=False)
        yield row


def _read(block: Block) -> pa.Table:
    """Return a block's columns; its file's row groups are no larger than blocks, so little more is read."""
    file = _opened(block.path)
    ends = np.cumsum([file.metadata.row_group(g).num_rows for g in range(file.num_row_groups)])
    first, last = np.searchsorted(ends, [block.start, block.stop - 1], side="right")
    begun = int(ends[first - 1]) if first else 0
    names = [name for name in COLUMNS if name in file.schema_arrow.names]
    table = file.read_row_groups(range(int(first), int(last) + 1), columns=names, use_threads=False)
    return _with_stamps(table.slice(block.start - begun, block.stop - block.start))


def _with_stamps(table: pa.Table) -> pa.Table:
    """Return a table whose stamps are nanoseconds, where they were points in time."""
    place = table.schema.get_field_index("stamp")
    if place < 0 or not pa.types.is_timestamp(table.schema.field(place).type):
        return table
    stamps = table.column(place).cast(pa.timestamp("ns")).cast(pa.int64())
    return table.set_column(place, "stamp", stamps)


@lru_cache(maxsize=4)
def _opened(path: str) -> pq.ParquetFile:
    return pq.ParquetFile(path, pre_buffer=False)
