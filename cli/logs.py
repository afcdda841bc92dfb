"""Logs of other tools: their scans, and what was made of them."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, TextIO, TypeVar

from .errors import WrongUseError
from .inputs import existing
from .printing import noted, plain
from .scans import needing_formats

if TYPE_CHECKING:
    from formats import Log, LoggedScan, LogOptions

T = TypeVar("T")


def opened(path: Path, options: LogOptions) -> Log:
    """Open a log.

    Raises
    ------
    WrongUseError
        When there is no such file.
    RefusedError
        When it cannot be read.
    """
    with needing_formats(f"reading {existing(path).name}"):
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


def some_scans(log: Path, most: int, topic: str | None = None, tf_namespace: str | None = None) -> list[LoggedScan]:
    """Return some scans of a log, evenly over all of it; print on stderr what was made of the log.

    Raises
    ------
    WrongUseError, RefusedError
        As of `opened`.
    """
    source = opened(log, options_of(topic, tf_namespace))
    taken = thinned(scans_of(source), most)
    print_notes(source, sys.stderr)
    return taken


def thinned(found: Iterable[T], most: int) -> list[T]:
    """Return so many, evenly over all, without all of them in memory; all of them where there are no more."""
    kept: list[T] = []
    step = 1
    for number, one in enumerate(found):
        if number % step:
            continue
        kept.append(one)
        if len(kept) > 4 * most:
            kept, step = kept[::2], 2 * step
    count = min(most, len(kept))
    return [kept[k * len(kept) // count] for k in range(count)]


def print_notes(log: Log, where: TextIO) -> None:
    """Print the assumptions about a log, and its parts that were left out."""
    for kind in ("assumed", "dropped"):
        for note in getattr(log.report, kind):
            print(f"{kind:10}{plain(noted(asdict(note)))}", file=where)
