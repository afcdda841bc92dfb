"""Logs of other tools: their scans, what was made of them, and how they are sent to a server."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TextIO, TypeVar

import typer

from .errors import WrongUseError
from .inputs import needing_formats
from .printing import Json, noted, plain

if TYPE_CHECKING:
    from formats import Log, LoggedScan, LogOptions

T = TypeVar("T")
Topic = Annotated[
    str | None,
    typer.Option(
        help="Topic of the scans; for CARMEN the kind of line, such as FLASER. Default: the topic with most scans, or "
        "the first kind in a CARMEN log."
    ),
]
TfNamespace = Annotated[
    str | None,
    typer.Option(
        metavar="NAMESPACE",
        help="Namespace of the transforms in a bag of several robots, such as /robot1 for /robot1/tf.",
    ),
]


def opened(path: Path, options: LogOptions) -> Log:
    """Open a log.

    Raises
    ------
    WrongUseError
        When there is no such file.
    RefusedError
        When it cannot be read.
    """
    if not path.exists():
        raise WrongUseError(f"{path}: there is no such file; check the path and the working folder")
    with needing_formats(f"reading {path.name}"):
        from formats import read_log

        return read_log(path, options)


def options_of(
    topic: str | None, tf_namespace: str | None, mount: tuple[float, float, float] | None = None
) -> LogOptions:
    """Return what to take of a log; raises `WrongUseError` where the mount is no pose."""
    from registration import RigidTransform

    with needing_formats("reading a log"):
        from formats import LogOptions

        try:
            return LogOptions(topic, None, tf_namespace, None if mount is None else RigidTransform(*mount))
        except ValueError as error:
            raise WrongUseError(f"--mount: {error}") from error


def scans_of(log: Log) -> Iterator[LoggedScan]:
    """Yield the scans of a log; raises `RefusedError` where it is broken."""
    with needing_formats(f"reading {log.name}"):
        yield from log


def spread(found: Sequence[T], most: int) -> list[T]:
    """Return so many, evenly over all; all of them where there are no more."""
    count = min(most, len(found))
    return [found[k * len(found) // count] for k in range(count)]


def print_notes(log: Log, where: TextIO) -> None:
    """Print the assumptions about a log, and its parts that were left out."""
    for kind in ("assumed", "dropped"):
        for note in getattr(log.report, kind):
            print(f"{kind:10}{plain(noted(asdict(note)))}", file=where)


def sent(one: LoggedScan) -> Json:
    """Return a scan of a log as a request has it."""
    from formats import scan_json

    return scan_json(one)
