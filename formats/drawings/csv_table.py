"""Segments in CSV: tables of x1, y1, x2, y2, as programs and spreadsheets write them."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import dataclass
from pathlib import Path

from ..errors import IncompleteFileError, MalformedFileError, TooLargeError
from ..files import read_bounded, text_of
from ..limits import MAX_CSV_LINE, MAX_LINES, MAX_MAP_BYTES
from ..options import UNITS
from ..report import first_of, shown
from .drawing import Drawing

COLUMNS = ("x1", "y1", "x2", "y2")
SYNONYMS = {
    end + axis: f"{axis}{number}"
    for number, ends in ((1, ("start", "begin", "from", "s", "a")), (2, ("end", "to", "e", "b")))
    for end in ends
    for axis in "xy"
}
DELIMITERS = (";", "\t", "|", ",", " ")
COMMENTS = ("#", "%", "//")
NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|[-+]?(nan|inf(inity)?)", re.IGNORECASE)
GROUPED = re.compile(r"[-+]?[1-9]\d{0,2}[.,]\d{3}")  # as 7.000 in place of 7000
COMMA = re.compile(r"[-+]?\d+,\d+([eE][-+]?\d+)?")
UNIT = re.compile(r"(.*?)[\s_]*[\[(]\s*([\w-]+)\s*[\])]")  # x1 [mm], and x1_mm:
SUFFIX = re.compile(rf"(.*?)[\s_]({'|'.join(UNITS)})", re.IGNORECASE)
POINT = re.compile(r"(?:p|pt|pnt|point|pos|v|vertex)(?:([12])([xy])|([xy])([12]))")


@dataclass(frozen=True, slots=True)
class Table:
    """A table, and what its columns are.

    Attributes
    ----------
    rows : list of list of str
        Without the header.
    lines : list of int
        Of the file, where each row is.
    wanted : tuple of int
        Columns of x1, y1, x2 and y2.
    names : tuple of str
        Of all columns; empty where the file does not name them.
    metres : float
        Per unit.
    """

    rows: list[list[str]]
    lines: list[int]
    wanted: tuple[int, ...]
    names: tuple[str, ...]
    metres: float


def read_csv(path: Path, drawing: Drawing) -> None:
    """Read rows of x1, y1, x2, y2, metres unless an option or the header says otherwise.

    A first row may name the columns, then in any order and among others, which are properties of the segments. Lines
    that begin with ``#`` are comments.

    Raises
    ------
    FormatError
        When a row has no four numbers, or it is not clear which columns are the coordinates.
    """
    table = _table(_lines(path))
    _refuse_thousands([row[k] for row in table.rows for k in table.wanted if k < len(row)])
    drawing.metres = table.metres
    others = [k for k, _ in enumerate(table.names) if k not in table.wanted]
    commas, loose = 0, []
    for row, line in zip(table.rows, table.lines, strict=True):
        numbers = [number for k in table.wanted if k < len(row) and (number := _number(row[k])) is not None]
        texts = [cell for cell in row if cell and _number(cell) is None]
        if len(numbers) < len(COLUMNS):
            wrong = next(k for k in table.wanted if k >= len(row) or _number(row[k]) is None)
            found = f"'{shown(row[wrong])}' in column {wrong + 1}" if wrong < len(row) else f"{len(row)} cells"
            raise MalformedFileError(f"line {line}: expected rows of x1, y1, x2, y2, found {found}")
        most = len(table.names) or len(COLUMNS)
        if (count := sum(_number(cell) is not None for cell in row)) > most:
            raise IncompleteFileError(
                f"line {line}: has {count} columns of numbers ({first_of(row)}), expected {most}, as x1, y1, x2, y2. "
                "An index, z, or decimal commas make more. Delete the others, or name all columns in a first row, "
                "x1,y1,x2,y2 among them"
            )
        commas += any("," in row[k] for k in table.wanted)
        properties = {table.names[k]: row[k] for k in others if k < len(row)}
        layer = properties.get("layer", texts[0] if texts and not table.names else None)
        if not others and layer is None:
            loose.append(numbers)
        elif drawing.takes((layer,) if layer else (), properties):
            x1, y1, x2, y2 = numbers
            z1, z2 = (_number(properties.get(key, "")) or 0.0 for key in ("z1", "z2"))
            layers = (layer,) if layer else ()
            drawing.add([(x1, y1, z1), (x2, y2, z2)], layers=layers, properties=properties, groups=layers)
    drawing.add_segments(loose)
    if not table.names:
        drawing.notes.add_assumed("columns", "columns are assumed to be x1, y1, x2, y2, because the file names none")
    if commas:
        drawing.notes.add_assumed("decimal_comma", "rows whose decimal mark is a comma", commas)


def _refuse_thousands(cells: list[str]) -> None:
    """Refuse 7.000 among whole numbers such as 950: one who writes zeros behind a decimal mark writes 950.000."""
    grouped = next((cell for cell in cells if GROUPED.fullmatch(cell) and cell.endswith("0")), "")
    whole = next((cell for cell in cells if cell.lstrip("+-").isdigit() and cell.strip("+-0")), "")
    if grouped and whole and all(GROUPED.fullmatch(cell) or cell.lstrip("+-").isdigit() for cell in cells):
        raise MalformedFileError(
            f"has {grouped} next to {whole}, so that its mark seems to separate thousands; expected {grouped[:-4]}"
            f"{grouped[-3:]}, or decimals in all numbers. Save the table without a mark for thousands"
        )


def _lines(path: Path) -> list[str]:
    text = text_of(read_bounded(path, MAX_MAP_BYTES))
    ends = sum(text.count(end) for end in ("\n", "\r"))
    if ends > 2 * MAX_LINES:
        raise TooLargeError(f"expected at most {MAX_LINES} lines, found {ends} line ends")
    lines = list(io.StringIO(text, newline=None))
    longest = max(map(len, lines), default=0)
    if len(lines) > MAX_LINES or longest > MAX_CSV_LINE:
        raise TooLargeError(
            f"expected at most {MAX_LINES} lines of {MAX_CSV_LINE} characters, found {len(lines)} of at most {longest}"
        )
    return lines


def _table(lines: list[str]) -> Table:
    """Return the table by the delimiter that gives four numbers, or a header; else by the most frequent one."""
    kept = [(k, line) for k, line in enumerate(lines, 1) if line.strip(" \t\r\n,;|") and not line.startswith(COMMENTS)]
    named = [line for line in lines[: kept[0][0] - 1] if line.startswith(COMMENTS)] if kept else []
    named = [line.lstrip("#%/ ") for line in named]  # numpy and Matlab put the names of columns into a comment
    header_line = next((line for line in named if any(_columns(_cells(line, one))[2] for one in DELIMITERS)), "")
    if header_line:
        kept.insert(0, (kept[0][0], header_line))
    first = kept[0][1] if kept else ""
    likely = next((one for one in DELIMITERS if one in first), ",")
    for delimiter in (*DELIMITERS, likely):
        header = _cells(first, delimiter)
        columns, metres, names = _columns(header)
        if names or sum(_number(cell) is not None for cell in header) >= len(COLUMNS):
            break
    else:
        found = first_of(header) or "none"
        raise MalformedFileError(
            f"line {kept[0][0] if kept else 1}: expected rows of x1, y1, x2, y2, or a row of these names, found {found}"
        )
    kept = kept[1:] if names else kept
    try:
        reader = csv.reader((line for _, line in kept), delimiter=delimiter)
        rows, at = [], []
        for row in reader:
            rows.append([cell.strip() for cell in row])
            at.append(kept[reader.line_num - 1][0])
    except csv.Error as error:
        raise MalformedFileError(
            "expected rows of x1, y1, x2, y2, found cells that cannot be divided: check the quotes"
        ) from error
    return Table(rows, at, columns, names, metres)


def _cells(line: str, delimiter: str) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]
    except csv.Error:
        return []


def _columns(first: list[str]) -> tuple[tuple[int, ...], float, tuple[str, ...]]:
    """Return the columns of the coordinates, metres per unit, and the names of all; no names where it has none."""
    parts = [UNIT.fullmatch(cell) or SUFFIX.fullmatch(cell) for cell in first]
    units = [found[2].casefold() if found else None for found in parts]
    names = [(found[1] if found else cell).casefold().strip() for found, cell in zip(parts, first, strict=True)]
    short = [POINT.sub(r"\2\3\1\4", re.sub(r"[\s_.-]", "", name)) for name in names]
    if {"x0", "y0", "x1", "y1"} <= set(short) and not set(COLUMNS) <= set(short):
        short = [{"x0": "x1", "y0": "y1", "x1": "x2", "y1": "y2"}.get(name, name) for name in short]
    short = [SYNONYMS.get(name, SYNONYMS.get(name[1:] + name[:1], name)) for name in short]
    if not all(short.count(column) == 1 for column in COLUMNS):
        numeric = tuple(k for k, cell in enumerate(first) if _number(cell) is not None)
        return numeric[:4] if len(numeric) >= len(COLUMNS) else (0, 1, 2, 3), 1.0, ()
    wanted = tuple(short.index(column) for column in COLUMNS)
    told = {units[k] for k in wanted}
    metres = UNITS.get(told.pop() or "m", 0.0) if len(told) == 1 else 0.0
    return (wanted, metres, tuple(names)) if metres else ((0, 1, 2, 3), 1.0, ())


def _number(cell: str) -> float | None:
    cell = cell.replace("\u2212", "-")  # a minus sign
    if COMMA.fullmatch(cell):
        return float(cell.replace(",", "."))
    return float(cell) if NUMBER.fullmatch(cell) else None
