"""Blocks: the scans that a worker does at a time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

import linefix
from association import Scan
from linefix.ranges import RangeScan
from registration import MeasuredSegments, Segments
from vectorization import LaserScan, Motion

from .errors import UnreadableScansError
from .tables import BOUNDS, COLUMNS, MOTION

SIGMA = 0.02  # m, of the points of segments without a sigma; as over HTTP


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


@dataclass(frozen=True, slots=True)
class Row:
    """One scan as it is in its file.

    Attributes
    ----------
    index : int
        In its log.
    values : dict
        By column; `ranges` as an array.
    """

    index: int
    values: dict[str, Any]

    def scan(self) -> Scan:
        """Return the scans to search.

        Raises
        ------
        InputError
            When it is no scan.
        """
        if self.values.get("error") is not None:
            raise UnreadableScansError(self.values["error"], argument="log")
        if self.values.get("ranges") is not None:
            return self._laser()
        if self.values.get("segments") is not None:
            return self._segments()
        raise UnreadableScansError("expected ranges or segments, found neither", argument="scan")

    def _laser(self) -> Scan:
        angle_min, increment = self._number("angle_min"), self._number("angle_increment")
        if angle_min is None or increment is None:
            raise UnreadableScansError("expected a number", argument="angle_min and angle_increment")
        bounds = {name: bound for name in BOUNDS if (bound := self._number(name)) is not None}
        laser = LaserScan(angle_min, increment, self.values["ranges"], motion=self._motion(), **bounds)
        seen = RangeScan(laser, self._number("time_increment") or 0.0, flipped=bool(self.values.get("flipped")))
        return linefix.assemble([linefix.view_of(seen, sigma=self._number("sigma"))])

    def _motion(self) -> Motion | None:
        increment, *twist = (self._number(name) for name in MOTION)
        known = [one for one in twist if one is not None]
        return Motion(increment, *known) if increment and len(known) == 3 else None

    def _segments(self) -> Scan:
        try:
            rows = np.array(self.values["segments"], dtype=np.float64).reshape(-1, 4)
        except (TypeError, ValueError):
            raise UnreadableScansError("expected rows of four numbers", argument="segments") from None
        sigma = self._number("sigma")
        segments = Segments.from_array(rows, argument="segments")
        return Scan(MeasuredSegments.from_segments(segments, SIGMA if sigma is None else sigma))

    def _number(self, name: str) -> float | None:
        value = self.values.get(name)
        return None if value is None else float(value)


def rows_of(block: Block) -> Iterator[Row]:
    """Yield the scans of a block."""
    table = _read(block)
    ranges = table.column("ranges") if "ranges" in table.column_names else pa.nulls(len(table))
    rest = table.select([name for name in table.column_names if name != "ranges"]).to_pylist()
    for k, (values, one) in enumerate(zip(rest or [{} for _ in ranges], ranges, strict=True)):
        if one.is_valid:
            values["ranges"] = one.values.to_numpy(zero_copy_only=False).astype(np.float64, copy=False)
        yield Row(block.start + k, values)


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
