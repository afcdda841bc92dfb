"""The output of a command: answers for people and for programs, and the progress of long work."""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

from .errors import RefusedError
from .options import flag

Json = dict[str, Any]
Lines = Iterable[str]

LOOK_SECONDS = 0.3
REPORT_SECONDS = 10.0  # between two lines where there is no terminal
UNLIKELY = 0.1  # probability of a pose below which the map may be wrong
HINT = "linefix map check MAP --log LOG{} tests the scale, the handedness and the directions of the map"


@dataclass(frozen=True, slots=True)
class Output:
    """The option that prints an answer as JSON."""

    as_json: bool = flag("Print the complete answer as JSON.", "--json")

    @property
    def notes(self) -> TextIO:
        """The stream for notes: with ``--json`` only documents are on stdout."""
        return sys.stderr if self.as_json else sys.stdout

    def print(self, answer: Any, lines: Lines) -> None:
        """Print an answer: its document, or lines for people."""
        if self.as_json:
            print_json(answer)
        else:
            print_lines(lines)


def print_json(answer: Any) -> None:
    """Print one document in one line, without control characters for a terminal."""
    from linefix.documents.encoding import encode

    # Terminals obey other characters than ASCII, and DEL; JSON of the standard library escapes all but the last.
    text = json.dumps(json.loads(encode(answer)), separators=(",", ":"))
    sys.stdout.write(text.replace("\x7f", "\\u007f") + "\n")


def write_json(document: Any, out: Path) -> None:
    """Write one document to a file; raises `RefusedError` where its name ends otherwise than in ``.json``."""
    from linefix.documents.encoding import encode

    if out.suffix.lower() != ".json":
        raise RefusedError(f"{out.name}: expected a name that ends in .json")
    out.write_bytes(encode(document) + b"\n")


def print_lines(lines: Lines, where: TextIO | None = None) -> None:
    """Print lines, by default on stdout, without control characters for a terminal."""
    for line in lines:
        print("".join(letter if letter.isprintable() else "?" for letter in line), file=where)


def rows(pairs: Iterable[tuple[str, str]], width: int = 0) -> Lines:
    """Return names and what they are, one a line."""
    found = list(pairs)
    width = width or max((len(name) + 2 for name, _ in found), default=0)
    return [name.ljust(width) + value for name, value in found]


def table(columns: Sequence[str], records: Iterable[Sequence[object]]) -> Lines:
    """Return the lines of a table; numbers stand on the right."""
    found = list(records)
    cells = [columns, *([shown(value) for value in record] for record in found)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    right = [all(isinstance(record[number], int | float) for record in found) for number in range(len(columns))]
    return [
        "  ".join(
            cell.rjust(width) if number else cell.ljust(width)
            for cell, width, number in zip(row, widths, right, strict=True)
        ).rstrip()
        for row in cells
    ]


def outline(document: Json) -> Iterator[str]:
    """Yield an object as text: its values; below their names, its lists of objects as tables, and its objects."""
    parts = {name: value for name, value in document.items() if _is_part(value)}
    yield from rows((name, shown(value)) for name, value in document.items() if name not in parts)
    for name, value in parts.items():
        yield from ("", name)
        yield from outline(value) if isinstance(value, dict) else listing(value)


def listing(objects: Sequence[Json]) -> Lines:
    """Return the table of objects with the same fields."""
    return table(tuple(objects[0]) if objects else ("none",), [tuple(one.values()) for one in objects])


def _is_part(value: Any) -> bool:
    """Tell whether a value is an object, or a list of them; a pose counts as a number."""
    inner = value if isinstance(value, list | tuple) else [value]
    return any(isinstance(one, dict) and "theta" not in one for one in inner)


def shown(value: Any) -> str:
    """Return a value's text; a missing value is a dash."""
    match value:
        case None | []:
            return "-"
        case {"theta": _}:
            return pose_text(value)
        case list() | tuple():
            return ", ".join(map(shown, value))
        case float():
            return f"{value:z.3f}"
    return str(value).lower() if isinstance(value, bool) else str(value)


def noted(note: Json) -> str:
    """Return the text of a note of an import or a log, with its count."""
    return f"{note['message']} ({note['count']})" if note["count"] else str(note["message"])


def verdict_rows(answer: Json) -> list[tuple[str, str]]:
    """Return the rows that show a person whether a pose was found, and which."""
    usable, probability = "usable" if answer["usable"] else "not usable", answer.get("probability")
    sure = "" if probability is None else f", probability {probability:.4f}"
    found = [("verdict", f"{answer['status']}, {usable}{sure}"), ("pose", pose_text(answer["pose"]))]
    if (covariance := answer["covariance"]) is not None:
        x, y, theta = (math.sqrt(max(0.0, covariance[k][k])) for k in range(3))
        found.append(("sigma", f"x {x:.4f} m, y {y:.4f} m, theta {math.degrees(theta):.3f} degrees"))
    if answer["unobservable"] is not None:
        dx, dy = answer["unobservable"]
        found.append(("free along", f"({dx:.3f}, {dy:.3f})"))
    for name in ("reasons", "warnings"):
        found += [(name.rstrip("s"), f"{one['code']}: {one['message']}") for one in answer.get(name, [])]
    if 0.0 < (probability or 0.0) < UNLIKELY:
        found.append(("hint", HINT.format("")))
    return found


def pose_text(pose: Json | None) -> str:
    """Return a pose for people."""
    if pose is None:
        return "none"
    x, y, theta = pose["x"], pose["y"], pose["theta"]
    return f"x {x:.3f} m, y {y:.3f} m, theta {theta:.4f} rad ({math.degrees(theta):.1f} degrees)"


@contextmanager
def progress() -> Iterator[Callable[[str, float, float | None], None]]:
    """Show the progress on a terminal, never in piped output; yield the function that takes stage, done and total."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    bars = Progress(*columns, console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty())
    tasks: dict[str, Any] = {}

    def show(stage: str, done: float, total: float | None) -> None:
        bars.start()  # not before: that of the compiler may come first
        if stage not in tasks:
            tasks[stage] = bars.add_task(stage, completed=int(done), total=total)
        bars.update(tasks[stage], completed=done, total=total)

    try:
        yield show
    finally:
        bars.stop()


def compile_first() -> None:
    """Compile the kernels that are not cached, in a process that ends with it: the compiler takes 330 MB.

    A terminal shows a bar; elsewhere a line every ten seconds reports the progress.
    """
    from compiled import compiled_fraction, is_complete

    if is_complete():
        return
    from linefix.compiling import start_compiler

    message = "linefix: compiling the kernels, about a minute on two idle cores; later runs load them from the cache"
    print(message, file=sys.stderr)
    reported = time.monotonic()
    # If it ends early or can keep nothing this process compiles what it needs.
    with progress() as show, suppress(OSError), start_compiler() as compiler:
        try:
            while compiler.poll() is None:
                fraction = compiled_fraction()
                show("kernels, %", round(100.0 * fraction), 100)
                if not sys.stderr.isatty() and time.monotonic() - reported > REPORT_SECONDS:
                    reported = time.monotonic()
                    print(f"linefix: {fraction:.0%} of the kernels are compiled", file=sys.stderr)
                time.sleep(LOOK_SECONDS)
        finally:
            compiler.kill()
