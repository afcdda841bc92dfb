"""The program of the bounded process for a log: a form to some of its scans and a report."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from linefix.documents.errors import Fault, InvalidRequestError

from .fields import Fields
from .own_files import Lines, OwnFiles, read_own

if TYPE_CHECKING:
    from formats import LoggedScan

MAX_SCANS = 1000
DEFAULT_SCANS = 100
KNOWN = ("topic", "max_scans")


def read_scans(content: bytes, content_type: str, folder: Path) -> Lines:
    """Return a report and scans, or an error for which there is another status than 422.

    Raises
    ------
    InvalidRequestError
        When the form, an option or a file is wrong.
    """
    from formats import LOG_SUFFIXES, LogOptions, read_log, scan_json

    from .form import read_form

    form = read_form(content, content_type)
    topic, most = _options_of(form.fields)

    def read(files: OwnFiles) -> Lines:
        log = read_log(files.map, LogOptions(topic=topic))
        chosen, count = spread(log, most)
        report = asdict(log.report)
        report["files"] = tuple(map(files.as_sent, report["files"]))
        return [{"report": report, "count": count}, {"scans": list(map(scan_json, chosen))}]

    return read_own(form, folder, read, LOG_SUFFIXES, "log", "one log, or a bag with its metadata.yaml")


def spread(scans: Iterable[LoggedScan], most: int) -> tuple[list[LoggedScan], int]:
    """Return at most `most` scans that are evenly spread over a log, the first among them, and how many it has."""
    kept: list[LoggedScan] = []
    step, count = 1, 0
    for number, one in enumerate(scans):
        count = number + 1
        if number % step:
            continue
        if len(kept) == most:
            kept, step = kept[::2], 2 * step
            if number % step:
                continue
        kept.append(one)
    return kept, count


def _options_of(fields: Fields) -> tuple[str | None, int]:
    """Return the topic and the greatest number of scans."""
    unknown = [
        Fault(f"/{name}", f"unknown field; expected one of {', '.join(KNOWN)}") for name in fields if name not in KNOWN
    ]
    if unknown:
        raise InvalidRequestError(unknown)
    twice = [
        Fault(f"/{name}", f"expected this field once, found it {len(v)} times")
        for name, v in fields.items()
        if len(v) > 1
    ]
    if twice:
        raise InvalidRequestError(twice)
    topic, most = (next(iter(fields.get(name, ())), None) for name in KNOWN)
    if most is None:
        return topic, DEFAULT_SCANS
    if not (most.isascii() and most.isdecimal() and len(most) < 5 and 1 <= int(most) <= MAX_SCANS):
        found = "another integer" if most.removeprefix("-").isdecimal() else "text that is no integer"
        raise InvalidRequestError([Fault("/max_scans", f"expected an integer from 1 to {MAX_SCANS}, found {found}")])
    return topic, int(most)
