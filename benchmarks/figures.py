"""The one file of figures that the documents quote: ``python -m benchmarks.figures --check`` or ``--write``.

``python -m benchmarks TABLE --results benchmarks/results.json`` writes the rows of a table into the file, with command,
commit, date and machine. A document quotes a figure and names it in a comment behind it::

    right in 95 %<!--= localization: scan: right first --> of the scans

A page for developers has whole runs as tables, between ``<!-- table: RUN -->`` and ``<!-- end -->``.

``--check`` lists the figures and tables in documents that are not in the file or differ from it. ``--write`` corrects
them, figures with as many digits as the document has.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

from .table import Row, machine

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "benchmarks" / "results.json"
NUMBER = r"\d[\d,]*(?:\.\d+)?"
QUOTED = re.compile(
    rf"(?P<shown>{NUMBER}(?: of {NUMBER})?)(?P<unit> ?[%a-zA-Z]*)<!--= (?P<run>[\w-]+): (?P<what>[^>]+?) -->"
)
TABLE = re.compile(r"(?<=<!-- table: )(?P<run>[\w-]+) -->\n(?P<body>.*?)(?=<!-- end -->)", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Quote:
    """A figure in a document.

    Attributes
    ----------
    document : Path
    shown, unit : str
        As the document has it, such as ``95`` and ``%``.
    run, what : str
        Its name in the file.
    span : tuple of int
        Begin and end of `shown` in the text.
    """

    document: Path
    shown: str
    unit: str
    run: str
    what: str
    span: tuple[int, int]


def documents() -> list[Path]:
    """Return the documents for users; those for developers quote runs of their own."""
    pages = [path for path in (ROOT / "docs").rglob("*.md") if "dev" not in path.relative_to(ROOT).parts]
    return [ROOT / "README.md", *sorted(pages)]


def pages_with_tables() -> list[Path]:
    """Return the documents that may have tables of whole runs."""
    return sorted((ROOT / "docs" / "dev").glob("*.md"))


def table(run: dict[str, Any]) -> str:
    """Return a run as a table, with its origin in a line above it."""
    origin = f"`{run['command']}`, commit `{run['commit']}`, {run['date']}. {run['machine']}; load: {run['load']}."
    rows = "".join(f"| {what} | {measured} |\n" for what, measured in run["figures"].items())
    return f"\n{origin}\n\n| what | measured |\n|---|---|\n{rows}\n"


def wrong_tables(document: Path, runs: dict[str, Any]) -> Iterator[str]:
    """Give what is wrong with the tables of a document."""
    where = document.relative_to(ROOT)
    for found in TABLE.finditer(document.read_text()):
        if found["run"] not in runs:
            yield f"{where}: the file has no run {found['run']}"
        elif found["body"] != table(runs[found["run"]]):
            yield f"{where}: the table of {found['run']} differs from the file"


def rewrite_tables(document: Path, runs: dict[str, Any]) -> None:
    """Fill the tables of a document from the file."""

    def filled(found: re.Match[str]) -> str:
        return f"{found['run']} -->\n{table(runs[found['run']])}" if found["run"] in runs else found[0]

    document.write_text(TABLE.sub(filled, document.read_text()))


def results(path: Path = RESULTS) -> dict[str, Any]:
    """Return the runs by name."""
    found: dict[str, Any] = json.loads(path.read_text()) if path.exists() else {}
    return found


def record(path: Path, name: str, command: str, rows: Sequence[Row]) -> None:
    """Write the rows of a table into the file, in place of those of an earlier run."""
    changed = subprocess.run(
        ["git", "status", "--porcelain", "-uno"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    runs = results(path)
    runs[name] = {
        "command": command,
        "commit": commit.stdout.strip() + (", with changes" if changed.stdout.strip() else ""),
        "date": date.today().isoformat(),
        "machine": machine(),
        "load": f"{os.getloadavg()[0]:.1f} at the end of the run, 1 or less: idle",
        "figures": {row.what.strip(): row.measured for row in rows},
    }
    path.write_text(json.dumps(dict(sorted(runs.items())), indent=1, ensure_ascii=False) + "\n")


def quotes(document: Path) -> Iterator[Quote]:
    """Give the figures that a document quotes."""
    for found in QUOTED.finditer(document.read_text()):
        yield Quote(document, found["shown"], found["unit"].strip(), found["run"], found["what"], found.span("shown"))


def expected(quote: Quote, measured: str) -> str:
    """Return a figure as the document should have it, with as many digits.

    A count "1 of 629" is looked for in the measured text, which may have more in it. A per cent of a fraction is
    100 times it.
    """
    if " of " in quote.shown:
        counts = re.search(rf"{NUMBER} of {NUMBER}", measured)
        return "not measured" if counts is None else grouped(counts[0])
    first = re.search(NUMBER, measured)
    if first is None:
        return "not measured"
    value = float(first[0].replace(",", ""))
    if quote.unit == "%" and "%" not in measured + quote.what:
        value *= 100.0
    digits = len(quote.shown.partition(".")[2])
    return f"{value:,.{digits}f}"


def grouped(text: str) -> str:
    """Return a text whose numbers have commas between thousands."""
    return re.sub(r"\d[\d,]*", lambda found: f"{int(found[0].replace(',', '')):,}", text)


def wrong(quote: Quote, runs: dict[str, Any]) -> str | None:
    """Return what is wrong with a quoted figure, or None."""
    where = f"{quote.document.relative_to(ROOT)}: {quote.shown} {quote.unit}".rstrip()
    measured = runs.get(quote.run, {}).get("figures", {}).get(quote.what)
    if measured is None:
        return f"{where}: the file has no figure {quote.run}: {quote.what}"
    right = expected(quote, str(measured))
    return None if right == quote.shown else f"{where}: {quote.run}: {quote.what} is {right}"


def rewrite(document: Path, runs: dict[str, Any]) -> None:
    """Correct the figures of a document that differ from the file."""
    text = document.read_text()
    for quote in reversed(list(quotes(document))):
        measured = runs.get(quote.run, {}).get("figures", {}).get(quote.what)
        if measured is not None:
            text = text[: quote.span[0]] + expected(quote, str(measured)) + text[quote.span[1] :]
    document.write_text(text)


def main() -> None:
    """Check or correct the figures of all documents."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.figures", description=__doc__)
    chosen = parser.add_mutually_exclusive_group(required=True)
    chosen.add_argument(
        "--check", action="store_true", help="list figures and tables that are not in the file or differ; exit code 1"
    )
    chosen.add_argument("--write", action="store_true", help="correct figures and tables that differ")
    runs = results()
    if parser.parse_args().write:
        for document in documents():
            rewrite(document, runs)
        for page in pages_with_tables():
            rewrite_tables(page, runs)
    faults = [fault for document in documents() for quote in quotes(document) if (fault := wrong(quote, runs))]
    faults += [fault for page in pages_with_tables() for fault in wrong_tables(page, runs)]
    print("\n".join(faults) or "all figures are those of the file")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
