"""The program of the bounded process for a log: a form to some of its scans and a report."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

from ..schemas.errors import Fault, InvalidRequestError
from .fields import Fields
from .own_files import METADATA, fault_of, own_files

if TYPE_CHECKING:
    from formats import LoggedScan

MAX_SCANS = 1000
DEFAULT_SCANS = 100
KNOWN = ("topic", "max_scans")


def read_scans(content: bytes, content_type: str, folder: Path) -> list[dict[str, Any]]:
    """Return a report and scans, or an error for which there is another status than 422.

    Raises
    ------
    InvalidRequestError
        When the form, an option or a file is wrong.
    """
    from formats import FormatError, LogOptions, TooLargeError, UnsupportedFormatError, read_log, scan_json

    from .form import read_form

    form = read_form(content, content_type)
    topic, most = _options_of(form.fields)
    names = list(form.files)
    try:
        files = own_files(names, _log_among(names), folder)
        for name, data in form.files.items():
            files.paths[name].write_bytes(data)
        form.files.clear()
        log = read_log(files.map, LogOptions(topic=topic))
        chosen, count = spread(log, most)
        report = asdict(log.report)
    except TooLargeError as error:
        return [{"too_large": error.message}]
    except UnsupportedFormatError as error:
        return [{"unknown": error.message}]
    except FormatError as error:
        raise InvalidRequestError([fault_of(error, files)]) from None
    report["files"] = tuple(map(files.as_sent, report["files"]))
    return [{"report": report, "count": count}, {"scans": list(map(scan_json, chosen))}]


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
        raise InvalidRequestError([Fault("/max_scans", f"expected an integer from 1 to {MAX_SCANS}")])
    return topic, int(most)


def _log_among(names: list[str]) -> str:
    """Return which file is the log; of a bag of ROS 2 in several files it is the metadata."""
    from formats import LOG_SUFFIXES, UnsupportedFormatError

    if METADATA in names:
        return METADATA
    logs = [name for name in names if PurePosixPath(name).suffix.lower() in LOG_SUFFIXES]
    if len(logs) > 1:
        raise InvalidRequestError(
            [Fault("/files", f"expected one log, or a bag with its metadata.yaml; found {len(logs)} logs")]
        )
    if not names:
        raise InvalidRequestError(
            [Fault("/files", "expected a file, found none; send a part of the form that has a filename")]
        )
    if not logs:
        raise UnsupportedFormatError(
            f"found no log; expected a file that ends in one of {', '.join(LOG_SUFFIXES)}", argument="files"
        )
    return logs[0]
