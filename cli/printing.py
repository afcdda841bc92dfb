"""Answers for people and for programs."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

Json = dict[str, Any]
WIDEST = 10_000  # characters of a row


def print_json(answer: Any) -> None:
    """Print one document in one line, without control characters for a terminal."""
    from linefix.documents.encoding import encode

    sys.stdout.write(escaped(encode(answer).decode()) + "\n")


def write_json(document: Any, out: Path) -> None:
    """Write one document to a file."""
    from linefix.documents.encoding import encode

    out.write_bytes(encode(document) + b"\n")


def console(width: int | None = None) -> Console:
    """Return where people read, by default as wide as the terminal; nothing printed there is taken for markup."""
    from rich.console import Console

    return Console(highlight=False, markup=False, emoji=False, soft_wrap=True, width=width)


def plain(text: object) -> Text:
    """Return text of a file or a server without control characters for a terminal."""
    from rich.text import Text

    return Text("".join(letter if letter.isprintable() else "?" for letter in str(text)))


def print_rows(rows: Sequence[tuple[str, str]]) -> None:
    """Print names and what they are, one a line."""
    width = max((len(name) for name, _ in rows), default=0) + 2
    where = console()
    for name, value in rows:
        where.print(plain(name.ljust(width) + value))


def noted(note: Json) -> str:
    """Return the text of a note of an import or a log, with its count."""
    return f"{note['message']} ({note['count']})" if note["count"] else str(note["message"])


def print_table(columns: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print a table; numbers stand on the right."""
    from rich.measure import Measurement
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="bold")
    for number, name in enumerate(columns):
        right = all(isinstance(row[number], int | float) for row in rows)
        table.add_column(name, justify="right" if right else "left", no_wrap=True)
    for row in rows:
        table.add_row(*(plain(shown(cell)) for cell in row))
    # As wide as its cells, whatever the terminal: a name or a number that is cut is lost.
    where = console(WIDEST)
    where.width = Measurement.get(where, where.options, table).maximum
    where.print(table)


def shown(value: object) -> str:
    """Return a cell's text; a missing value is a dash."""
    if value is None:
        return "-"
    return f"{value:.3f}" if isinstance(value, float) else str(value)


def verdict_rows(answer: Json) -> list[tuple[str, str]]:
    """Return the rows that show a person whether a pose was found, and which."""
    usable = "usable" if answer["usable"] else "not usable"
    told = f"{answer['status']}, {usable}"
    if answer.get("probability") is not None:
        told += f", probability {answer['probability']:.4f}"
    rows = [("verdict", told), ("pose", pose_text(answer["pose"]))]
    covariance = answer["covariance"]
    if covariance is not None:
        x, y, theta = (math.sqrt(max(0.0, covariance[k][k])) for k in range(3))
        rows.append(("sigma", f"x {x:.4f} m, y {y:.4f} m, theta {math.degrees(theta):.3f} degrees"))
    if answer["unobservable"] is not None:
        dx, dy = answer["unobservable"]
        rows.append(("free along", f"({dx:.3f}, {dy:.3f})"))
    for name in ("reasons", "warnings"):
        rows += [(name.rstrip("s"), f"{one['code']}: {one['message']}") for one in answer.get(name, [])]
    return rows


def pose_text(pose: Json | None) -> str:
    """Return a pose for people."""
    if pose is None:
        return "none"
    x, y, theta = pose["x"], pose["y"], pose["theta"]
    return f"x {x:.3f} m, y {y:.3f} m, theta {theta:.4f} rad ({math.degrees(theta):.1f} degrees)"


def escaped(document: str) -> str:
    """Return a JSON document in one line with every character that is not printable as its escape.

    JSON escapes the control characters below 32 only; terminals obey those from 127 to 159 as well, and others change
    the direction of what follows.
    """
    if document.isascii() and "\x7f" not in document:
        return document
    return "".join(letter if letter.isprintable() else _escape(letter) for letter in document)


def _escape(letter: str) -> str:
    units = letter.encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{int.from_bytes(units[k : k + 2], 'big'):04x}" for k in range(0, len(units), 2))
