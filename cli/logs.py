"""Logs of other tools: their scans, and what was made of them."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, TextIO, TypeVar

from .errors import WrongUseError, needing
from .inputs import existing
from .options import TopicOptions
from .printing import noted, print_lines, rows

if TYPE_CHECKING:
    from formats import Log, LoggedScan
    from registration import RigidTransform

T = TypeVar("T")


def opened(path: Path, source: TopicOptions, mount: RigidTransform | None = None) -> Log:
    """Open a log.

    Raises
    ------
    WrongUseError
        When there is no such file.
    RefusedError
        When it cannot be read.
    """
    with needing(f"reading {existing(path).name}"):
        from formats import LogOptions, read_log

        return read_log(path, LogOptions(source.topic, source.odom, source.tf_namespace, mount, source.base))


def mount_of(given: tuple[float, float, float] | None) -> RigidTransform | None:
    """Return a mount that a user states; raises `WrongUseError` where it is no pose."""
    from registration import RigidTransform

    try:
        return None if given is None else RigidTransform(*given)
    except ValueError as error:
        raise WrongUseError(f"--mount: {error}") from error


def scans_of(log: Log) -> Iterator[LoggedScan]:
    """Yield the scans of a log; raises `RefusedError` where it is broken."""
    with needing(f"reading {log.name}"):
        yield from log


def some_scans(path: Path, most: int, source: TopicOptions) -> list[LoggedScan]:
    """Return some scans of a log, evenly over all of it; print on stderr what was made of the log; raises as above."""
    log = opened(path, source)
    taken = thinned(scans_of(log), most)
    print_notes(log, sys.stderr)
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
    report = asdict(log.report)
    print_lines(rows(((kind, noted(one)) for kind in ("assumed", "dropped") for one in report[kind]), 10), where)
