"""Many logged scans at a time next to `associate` in a bare loop: ``python -m benchmarks batch``.

Times are of one run, in which loop and workers take turns; what starting the workers takes is left out by the
difference of a long and a short run. Processor time is
reported, too: other work on the machine does not count in it.
"""

from __future__ import annotations

import json
import resource
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from association import MapIndex, Scan, associate
from batch import FleetOptions, Processes, associate_many
from batch.blocks import SIGMA
from registration import MeasuredSegments, Segments

from .growth import campus, draw_query
from .table import Row, at_least, print_rows

MAP_SEGMENTS = 2_000
DISTINCT = 32  # scans, each of which comes many times
SHORT, LONG = 1_024, 7_168
ROUNDS = 3
SEED = 20190901
EFFICIENCY = 0.9


@dataclass(frozen=True, slots=True)
class Spent:
    """Seconds that one more scan takes, by the clock and of processors."""

    wall: float
    processor: float


def batch(quick: int) -> list[Row]:
    """Measure the rates of the bare loop, one worker and two, by turns."""
    segments = campus(MAP_SEGMENTS)
    rng = np.random.default_rng(SEED)
    scans = [draw_query(segments, rng)[1] for _ in range(DISTINCT)]
    with tempfile.TemporaryDirectory() as folder:
        runs = _Runs(Path(folder), segments, scans, quick)
        found = [[runs.loop(), runs.workers(1), runs.workers(2)] for _ in range(ROUNDS)]
    loop, one, two = zip(*found, strict=True)
    rows = [
        Row("bare loop, scans a second", _rate(loop)),
        Row("1 worker", _rate(one)),
        Row("2 workers", _rate(two)),
        at_least("1 worker over the loop", _ratio(found, lambda r: r[0].wall / r[1].wall), EFFICIENCY),
        at_least("2 workers over twice 1 worker", _ratio(found, lambda r: r[1].wall / (2 * r[2].wall)), EFFICIENCY),
        at_least(
            "processor time a scan, loop over 1 worker",
            _ratio(found, lambda r: r[0].processor / r[1].processor),
            EFFICIENCY,
        ),
        at_least(
            "processor time a scan, loop over 2 workers",
            _ratio(found, lambda r: r[0].processor / r[2].processor),
            EFFICIENCY,
        ),
    ]
    print_rows(f"Batches of {LONG // quick:,} scans, {MAP_SEGMENTS:,} map segments", rows)
    return rows


def _rate(spent: tuple[Spent, ...]) -> str:
    return f"{1.0 / median(one.wall for one in spent):,.0f}"


def _ratio(found: list[list[Spent]], of: Callable[[list[Spent]], float]) -> float:
    return median(of(one) for one in found)


class _Runs:
    """The same scans, searched in different ways."""

    def __init__(self, folder: Path, segments: Segments, scans: list[Segments], quick: int) -> None:
        self._folder = folder
        self._index = MapIndex.build(segments)
        self._scans = [Scan(MeasuredSegments.from_segments(scan, SIGMA)) for scan in scans]
        self._counts = [SHORT // quick, LONG // quick]
        (folder / "map.json").write_text(json.dumps({"segments": segments.endpoints.tolist()}))
        rows = [scan.endpoints.tolist() for scan in scans]
        for count in self._counts:
            table = pa.table({"segments": [rows[k % len(rows)] for k in range(count)]})
            pq.write_table(table, self._log(count), row_group_size=128)

    def loop(self) -> Spent:
        """Search in this process."""
        options = FleetOptions().search
        count = self._counts[1] - self._counts[0]
        begun, used = time.perf_counter(), time.process_time()
        for k in range(count):
            associate(self._index, self._scans[k % len(self._scans)], None, options)
        return Spent((time.perf_counter() - begun) / count, (time.process_time() - used) / count)

    def workers(self, number: int) -> Spent:
        """Search by so many workers."""
        short, long = (self._batch(number, count) for count in self._counts)
        more = self._counts[1] - self._counts[0]
        return Spent((long.wall - short.wall) / more, (long.processor - short.processor) / more)

    def _batch(self, number: int, count: int) -> Spent:
        begun, used = time.perf_counter(), _used()
        options = FleetOptions(block=128)
        associate_many(
            [self._log(count)], self._folder / "map.json", self._folder / "out.parquet", options, Processes(number)
        )
        return Spent(time.perf_counter() - begun, _used() - used)

    def _log(self, count: int) -> Path:
        return self._folder / f"{count}.parquet"


def _used() -> float:
    """Return the processor seconds of this process and of those that it has started and ended."""
    both = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in both)
