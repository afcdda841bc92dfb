"""Logs to Parquet files whose row groups are no larger than blocks, so that any block is read alone."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, replace
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import orjson
import pyarrow as pa
import pyarrow.parquet as pq

from registration import InputError

from .blocks import Block
from .errors import UnreadableScansError
from .parts import whole
from .tables import BOUNDS, COLUMNS, FORMS, LASER, MOTION, SCANS

if TYPE_CHECKING:
    from formats import LoggedScan

PARQUET = (".parquet", ".pq")
NOTES = b"linefix.notes"  # in the metadata of a file that a log is laid out in


@dataclass(frozen=True, slots=True)
class Layout:
    """A log, and where its scans are laid out as blocks want them.

    Attributes
    ----------
    number : int
        Of the log, in the order in which they were named.
    log : str
        As the caller named it.
    path : str
        Of a Parquet file; the log itself where that is laid out so already.
    block : int
        Scans of a block.
    """

    number: int
    log: str
    path: str
    block: int

    @property
    def done(self) -> bool:
        """Return whether the file exists."""
        return Path(self.path).exists()

    def blocks(self) -> list[Block]:
        """Return the blocks: whole row groups, together no more than a block's scans."""
        metadata = pq.read_metadata(self.path)
        found: list[Block] = []
        start = stop = 0
        for group in range(metadata.num_row_groups):
            count = metadata.row_group(group).num_rows
            if stop > start and stop + count - start > self.block:
                found.append(Block(self.number, self.log, self.path, start, stop))
                start = stop
            stop += count
        return [*found, Block(self.number, self.log, self.path, start, stop)] if stop > start else found

    def notes(self) -> list[LogNote]:
        """Return the assumptions about a log of another tool, and its parts that were left out."""
        if Path(self.log).suffix.lower() in PARQUET:
            return []
        told = (pq.read_metadata(self.path).metadata or {}).get(NOTES, b"[]")
        return [LogNote(self.log, **note) for note in orjson.loads(told)]


@dataclass(frozen=True, slots=True)
class LogNote:
    """A note of logs: an assumption, or something that is left out.

    Attributes
    ----------
    log : str
        The first log that it was noted of, as the caller named it.
    kind : str
        ``assumed`` or ``dropped``.
    code, message : str
        As in the report of `formats.read_log`; the message is that of the first log.
    count : int
        Number of scans or messages in all logs; 0 where they are not counted.
    logs : int
        Number of logs that have a note with this code.
    """

    log: str
    kind: str
    code: str
    message: str
    count: int
    logs: int = 1


def merged_notes(layouts: Iterable[Layout]) -> tuple[LogNote, ...]:
    """Return one note for each kind and code, with the sums over all logs."""
    found: dict[tuple[str, str], LogNote] = {}
    for note in (note for layout in layouts for note in layout.notes()):
        first = found.setdefault((note.kind, note.code), note)
        if first is not note:
            both = replace(first, count=first.count + note.count, logs=first.logs + 1)
            found[note.kind, note.code] = both
    return tuple(found.values())


def layout_of(number: int, log: str, folder: Path, block: int) -> Layout:
    """Return where a log is, or is to be, laid out.

    Raises
    ------
    UnreadableScansError
        When it is a Parquet file that holds no scans.
    """
    path = Path(log)
    if path.suffix.lower() in PARQUET:
        metadata = _checked(path)
        groups = [metadata.row_group(group).num_rows for group in range(metadata.num_row_groups)]
        if max(groups, default=0) <= block:
            return Layout(number, log, log, block)
    return Layout(number, log, str(folder / f"{number:06d}.parquet"), block)


def lay_out(layout: Layout) -> None:
    """Write a log's scans in row groups of a block."""
    is_table = Path(layout.log).suffix.lower() in PARQUET
    parquet = pq.ParquetFile(layout.log, pre_buffer=False) if is_table else None
    schema = SCANS if parquet is None else parquet.schema_arrow
    with whole(Path(layout.path)) as file, pq.ParquetWriter(file, schema) as writer:
        if parquet is not None:
            for batch in parquet.iter_batches(layout.block, use_threads=False):
                writer.write_batch(batch, layout.block)
            return
        notes = list[dict[str, Any]]()
        found = _rows(layout.log, notes)
        while rows := list(islice(found, layout.block)):
            writer.write_table(pa.Table.from_pylist(rows, schema=SCANS))
        writer.add_key_value_metadata({NOTES: orjson.dumps(notes)})


def _rows(log: str, notes: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Yield the scans of a log of another tool; at the end a row for each unusable one, and for what ends the log.

    Its assumptions and omissions are added to `notes` at the end.
    """
    from formats import UNUSABLE, read_log

    try:
        opened = read_log(log)
        try:
            yield from map(_row, opened)
            for note in opened.report.dropped:
                if note.code in UNUSABLE:
                    yield from ({"error": note.message} for _ in range(note.count))
        finally:
            noted = (("assumed", opened.report.assumed), ("dropped", opened.report.dropped))
            notes += [{"kind": kind, **asdict(note)} for kind, some in noted for note in some]
    except InputError as error:
        yield {"error": f"the rest of the log cannot be read: {error}"}


def _row(scan: LoggedScan) -> dict[str, Any]:
    laser, motion = scan.laser, scan.laser.motion
    row: dict[str, Any] = {"stamp": scan.stamp_ns, "flipped": scan.flipped, "time_increment": scan.time_increment}
    row |= {name: getattr(laser, name) for name in (*LASER, *BOUNDS)}
    return row if motion is None else row | {name: getattr(motion, name) for name in MOTION[1:]}


def _checked(path: Path) -> pq.FileMetaData:
    """Return the metadata of a Parquet file of scans.

    Raises
    ------
    UnreadableScansError
        When it is none, or its columns are no scans'.
    """
    try:
        metadata = pq.read_metadata(path)
    except (pa.ArrowException, OSError) as error:
        raise UnreadableScansError(f"is not a Parquet file: {error}", argument=str(path)) from None
    for wrong in _faults(metadata.schema.to_arrow_schema()):
        raise UnreadableScansError(wrong, argument=str(path))
    return metadata


def _faults(schema: pa.Schema) -> Iterator[str]:
    if not any(name in schema.names for name in FORMS):
        yield f"expected a column {' or '.join(FORMS)}, found {', '.join(schema.names) or 'none'}"
    if "ranges" in schema.names:
        yield from (f"expected a column {name} in addition to ranges" for name in LASER if name not in schema.names)
    for field in schema:
        fits, expected = COLUMNS.get(field.name, (None, ""))
        if fits is not None and not fits(field.type):
            yield f"expected {expected} in {field.name}, found {field.type}"
