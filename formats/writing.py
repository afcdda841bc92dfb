"""Files out: maps as JSON, poses as TUM."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import orjson

from registration import RigidTransform

from .errors import UnsupportedFormatError
from .files import ending_of, name_of
from .line_map import LineMap

NS = 1_000_000_000


def write_map(map: LineMap, path: str | os.PathLike[str]) -> None:
    """Write a map as a map file of Linefix, so that reading it gives the same map.

    Parameters
    ----------
    map : LineMap
    path : str or path
        Ends in ``.json``.

    Raises
    ------
    UnsupportedFormatError
        When it ends in anything else.
    """
    file = Path(path)
    if file.suffix.lower() != ".json":
        raise UnsupportedFormatError(
            f"expected a name that ends in .json, found {ending_of(file)}", argument=name_of(file)
        )
    file.write_bytes(orjson.dumps(map.document, option=orjson.OPT_SERIALIZE_NUMPY))


@dataclass(frozen=True, slots=True)
class StampedPose:
    """A pose of the robot with its time.

    Attributes
    ----------
    stamp_ns : int
        Nanoseconds.
    pose : RigidTransform
        map_from_scan.
    """

    stamp_ns: int
    pose: RigidTransform


def write_tum(poses: Iterable[StampedPose], path: str | os.PathLike[str]) -> int:
    """Write poses as TUM has them: ``seconds x y z qx qy qz qw`` a line; return how many."""
    count = 0
    with Path(path).open("w", encoding="ascii", newline="\n") as file:
        for one in poses:
            seconds, rest = divmod(one.stamp_ns, NS)
            z, w = math.sin(0.5 * one.pose.theta), math.cos(0.5 * one.pose.theta)
            file.write(f"{seconds}.{rest:09d} {one.pose.x:.9f} {one.pose.y:.9f} 0 0 0 {z:.12f} {w:.12f}\n")
            count += 1
    return count
