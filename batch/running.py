"""The main path: logs and maps to one file of poses."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa

from .blocks import Block
from .engine import Engine, Lost, Processes
from .errors import UnreadableScansError
from .logs import Layout, LogNote, lay_out, layout_of, merged_notes
from .parts import Parts, opened
from .searching import BlockSearch, FleetOptions, MapShelf, lost_row, searching_on

PathLike = str | os.PathLike[str]
Watch = Callable[[str, int, int], None]


@dataclass(frozen=True, slots=True)
class Summary:
    """Counts of the rows of the output.

    Attributes
    ----------
    scans : int
        Rows.
    taken_over : int
        Number of rows that an earlier run had done.
    usable : int
    errors : int
        Rows with an error.
    statuses : dict of str to int
        Number of rows of each status; those with an error have none.
    notes : tuple of LogNote
        Assumptions and omissions of logs of other tools.
    """

    scans: int
    taken_over: int
    usable: int
    errors: int
    statuses: dict[str, int]
    notes: tuple[LogNote, ...] = ()


def associate_many(
    logs: Sequence[PathLike],
    maps: PathLike,
    out: PathLike,
    options: FleetOptions | None = None,
    engine: Engine | None = None,
    watch: Watch = lambda stage, done, total: None,
) -> Summary:
    """Find where the scans of many logs were taken; write one row for each.

    A run that was killed goes on where it was when it is called again.

    Parameters
    ----------
    logs : sequence of path
        Parquet files with the columns of `batch.tables`, or what `formats.read_log` reads.
    maps : path
        A map, or a folder of them. A scan lies on the one that its column ``map_id`` names, else on the one named as
        its log, else on the only one.
    out : path
        The Parquet file to write, with the columns `POSES`, in the order of logs and scans. It appears, whole, when all
        is done; until then a folder next to it grows.
    options : FleetOptions, optional
    engine : Engine, optional
        The engine that does the work; by default this machine's processes, one for each core.
    watch : callable, optional
        Called after each step, with its stage, the number that is done, and that of all: first logs in ``"reading"``,
        then scans in ``"searching"``.

    Returns
    -------
    Summary

    Raises
    ------
    FleetError
        When a log or the maps are not there, or an unfinished run of another kind is.
    WorkerError
        When a worker raised, which is a defect.
    """
    options = FleetOptions() if options is None else options
    engine = Processes(len(os.sched_getaffinity(0))) if engine is None else engine
    names = [os.fspath(log) for log in logs]
    shelf, target = MapShelf.at(maps), Path(out)
    if len(shelf.files) == 1:
        searching_on(*shelf.files.values(), options)  # an error in the only map spoils everything
    target.parent.mkdir(parents=True, exist_ok=True)
    with opened(target, _told(names, shelf, options)) as parts:
        layouts = [layout_of(number, name, parts.scans, options.block) for number, name in enumerate(names)]
        _lay_out(layouts, engine, watch)
        blocks = [block for layout in layouts for block in layout.blocks()]
        left = parts.left(blocks)
        total = sum(map(len, blocks))
        taken_over = searched = total - sum(map(len, left))
        watch("searching", searched, total)
        for count in _search(left, BlockSearch(shelf, options), engine, parts):
            searched += count
            watch("searching", searched, total)
        notes = merged_notes(layouts)  # before the parts are removed
        return _summary(parts.assemble(target), taken_over, notes)


def _lay_out(layouts: list[Layout], engine: Engine, watch: Watch) -> None:
    missing = [layout for layout in layouts if not layout.done]
    for done, (layout, outcome) in enumerate(engine.run(lay_out, missing), start=1):
        if isinstance(outcome, Lost):
            raise UnreadableScansError(
                "each worker that read it has ended; the log is damaged or needs more memory: check it, or omit it",
                argument=layout.log,
            )
        watch("reading", len(layouts) - len(missing) + done, len(layouts))


def _search(blocks: list[Block], search: BlockSearch, engine: Engine, parts: Parts) -> Iterator[int]:
    """Search all blocks; yield the number of scans of each that is done.

    A block that ends its workers is halved until the one scan is found that does.
    """
    while blocks:
        halves: list[Block] = []
        for block, outcome in engine.run(search, blocks):
            if isinstance(outcome, Lost) and len(block) > 1:
                halves += block.halves
                continue
            parts.keep(block, lost_row(block) if isinstance(outcome, Lost) else outcome)
            yield len(block)
        blocks = halves


def _summary(tables: Iterator[pa.Table], taken_over: int, notes: tuple[LogNote, ...]) -> Summary:
    usable, statuses = 0, Counter[Any]()
    for table in tables:
        usable += sum(table.column("usable").to_pylist())
        statuses.update(table.column("status").to_pylist())
    scans, errors = statuses.total(), statuses.pop(None, 0)  # a row with an error has no status
    return Summary(scans, taken_over, usable, errors, dict(statuses), notes)


def _told(names: list[str], shelf: MapShelf, options: FleetOptions) -> dict[str, Any]:
    """Return what makes two runs the same: files by path, size and time of change."""
    return {
        "logs": [_stamped(name) for name in names],
        "maps": [_stamped(path) for path in shelf.files.values()],
        "options": asdict(options),
    }


def _stamped(path: str) -> tuple[str, int, int]:
    try:
        state = Path(path).stat()
    except OSError as error:
        raise UnreadableScansError(error.strerror or "cannot be read", argument=path) from None
    return str(Path(path).resolve()), state.st_size, state.st_mtime_ns
