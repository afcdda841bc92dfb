"""The program of the bounded process for a log: a form to some of its scans and a report."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from .fields import SCANS_FIELDS, read_fields
from .own_files import Lines, OwnFiles, read_own

if TYPE_CHECKING:
    from formats import LoggedScan

DEFAULT_SCANS = 100


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
    options = read_fields(form.fields, SCANS_FIELDS)

    def read(files: OwnFiles) -> Lines:
        log = read_log(files.map, LogOptions(topic=options.get("topic")))
        chosen, count = spread(log, options.get("max_scans", DEFAULT_SCANS))
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
