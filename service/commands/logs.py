"""Logs of other tools to scans of requests."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from registration import RigidTransform

from .errors import WrongUseError
from .inputs import needing_formats
from .printing import noted, plain
from .service import Json

if TYPE_CHECKING:
    from formats import Log, LoggedScan
    from vectorization import LaserScan

T = TypeVar("T")
FARTHEST = 1e4  # m; where a log names no greatest range
Topic = Annotated[
    str | None, typer.Option(help="Of the scans; the one with most of them where not given. Of CARMEN FLASER or so.")
]


@dataclass(frozen=True, slots=True)
class ReplayedScan:
    """A scan of a log as it is asked for.

    Attributes
    ----------
    stamp_ns : int
        Nanoseconds.
    scan : dict
        As in a request.
    odometry : RigidTransform or None
        odom_from_sensor; None where the log does not say.
    frame : str
        The sensor's.
    mount : RigidTransform or None
        base_from_sensor; None where the log does not say.
    base : str
        The robot's own frame, which `mount` is in.
    """

    stamp_ns: int
    scan: Json
    odometry: RigidTransform | None
    frame: str
    mount: RigidTransform | None
    base: str


def opened(path: Path, topic: str | None) -> Log:
    """Open a log.

    Raises
    ------
    WrongUseError
        When there is no such file.
    RefusedError
        When it cannot be read.
    """
    if not path.exists():
        raise WrongUseError(f"{path}: there is no such file")
    with needing_formats(f"reading {path.name}"):
        from formats import LogOptions, read_log

        return read_log(path, LogOptions(topic=topic))


def scans_of(log: Log) -> Iterator[ReplayedScan]:
    """Give the scans of a log one by one; raises `RefusedError` where it is broken."""
    with needing_formats(f"reading {log.name}"):
        for one in log:
            yield ReplayedScan(one.stamp_ns, _scan(one), one.pose, one.frame_id, one.mount, one.base_frame)


def print_notes(log: Log) -> None:
    """Print the assumptions and omissions of a log on stderr; stdout holds the answer alone."""
    for kind in ("assumed", "dropped"):
        for note in getattr(log.report, kind):
            print(f"{kind:10}{plain(noted(asdict(note)))}", file=sys.stderr)


def spread(found: Sequence[T], most: int) -> list[T]:
    """Return so many at most, evenly over all."""
    step = max(1, math.ceil(len(found) / most))
    return list(found[::step])


def _scan(one: LoggedScan) -> Json:
    laser = one.laser
    # What is mounted upside down turns the other way round; its y axis is exchanged by that.
    sign = -1.0 if one.flipped else 1.0
    most = laser.range_max if math.isfinite(laser.range_max) else FARTHEST
    return {
        "laser": {
            "angle_min": sign * laser.angle_min,
            "angle_increment": sign * laser.angle_increment,
            "ranges": _ranges(laser, most),
            "range_max": most,
        },
        "stamp": one.stamp,
    }


def _ranges(laser: LaserScan, most: float) -> list[float | None]:
    """Return ranges as JSON has them: null where nothing is known, and beyond the greatest where nothing came back."""
    return [None if math.isnan(r) else 2.0 * most if math.isinf(r) else r for r in laser.cleaned.tolist()]
