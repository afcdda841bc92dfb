"""Logs of CARMEN: one message a line, as the public logs of Radish and Freiburg have them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from registration import InputError, RigidTransform
from vectorization import LaserScan

from ..errors import IncompleteFileError, MalformedFileError, TooLargeError
from ..files import BYTE_ORDER_MARK, WIDE, name_of
from ..limits import MAX_LINE_BYTES
from ..report import Notes
from .scan import Log, LoggedScan, LogOptions, none_usable
from .stamps import Stamps

KINDS = ("FLASER", "RLASER", "ROBOTLASER1", "ROBOTLASER2", "RAWLASER1", "RAWLASER2")
MESSAGES = {"ODOM", "TRUEPOS", "PARAM", "SYNC", "NMEAGGA", "NMEARMC", *KINDS}
NO_RETURN = 80.0  # m; what the range finders of these logs read, or more, where nothing came back


@dataclass(frozen=True, slots=True)
class _Angles:
    first: float  # radians
    step: float
    range_max: float  # metres


def read_carmen(path: Path, options: LogOptions) -> Log:
    """Open a log; poses are those of the laser, in the frame of odometry.

    Raises
    ------
    IncompleteFileError
        When there is no such file; while iterating, when no scan is in it, or none that is whole.
    TooLargeError
        While iterating, when a line is too long.
    """
    if not path.is_file():
        raise IncompleteFileError(
            "there is no such file; check the path and the working folder", argument=name_of(path)
        )
    return Log("carmen", name_of(path), partial(_scans, path, options))


def _scans(path: Path, options: LogOptions, notes: Notes) -> Iterator[LoggedScan]:
    name = name_of(path)
    wanted, stamps, first = options.topic, Stamps(notes), ""
    moves: bool | None = None
    seen: Counter[str] = Counter()
    for number, words in _messages(path, notes):
        kind = words[0]
        seen[kind] += 1
        if kind not in KINDS or (wanted is not None and kind != wanted):
            notes.add_dropped(f"message_{kind.lower()}", f"{kind} messages", 1)
            continue
        # The first kind of scan in the log is taken, so that a rear laser is not mixed with the front one.
        if wanted is None:
            wanted = kind
            notes.add_assumed("topic", f"scans are those of {kind}, the first kind in the log")
        try:
            scan = READERS[kind](words, kind)
        except InputError as error:
            first = first or error.message
            notes.add_dropped("broken_scan", f"scans that cannot be used, such as: {error.message}", 1)
            continue
        except (ValueError, LookupError, OverflowError):
            first = first or f"line {number} is broken"
            notes.add_dropped("broken_line", f"broken lines, the last at {number}", 1)
            continue
        stamps.of(scan.stamp_ns)
        notes.add_read("scans", f"{kind} scans", 1)
        moves = _moves(path, kind) if moves is None else moves
        if scan.pose is not None and not moves:
            notes.add_assumed("no_odometry", "no odometry was found: in all scans the robot is at 0, 0, 0")
            scan = replace(scan, pose=None, pose_frame="")
        yield scan
    if "scans" not in notes.read and first:
        raise none_usable(name, notes, first)
    if "scans" not in notes.read:
        there = ", ".join(f"{count} {kind}" for kind, count in sorted(seen.items())) or "no message of CARMEN"
        raise IncompleteFileError(f"has no {wanted or 'scan'}; it has {there}", argument=name)


def _moves(path: Path, kind: str) -> bool:
    """Tell whether the robot is anywhere but at 0, 0, 0 in the scans of a kind, up to the first such scan."""
    for _, words in _messages(path, Notes()):
        if words[0] != kind:
            continue
        try:
            scan = READERS[kind](words, kind)
        except (InputError, ValueError, LookupError, OverflowError):
            continue
        if scan.pose is None or scan.pose != scan.mount:
            return True
    return False


def _messages(path: Path, notes: Notes) -> Iterator[tuple[int, list[str]]]:
    with path.open("rb") as file:
        number = 0
        while line := file.readline(MAX_LINE_BYTES + 1):
            number += 1
            if len(line) > MAX_LINE_BYTES:
                raise TooLargeError(f"line {number}: expected at most {MAX_LINE_BYTES} bytes", argument=name_of(path))
            if number == 1 and line.startswith(WIDE):
                raise MalformedFileError("is text in UTF-16; save it as UTF-8", argument=name_of(path))
            words = line.removeprefix(BYTE_ORDER_MARK if number == 1 else b"").decode("ascii", "replace").split()
            if not words or words[0].startswith("#"):
                continue
            if words[0] in MESSAGES:
                yield number, words
            else:
                notes.add_dropped("other_lines", "lines that are not messages of CARMEN", 1)


def _simple(words: list[str], kind: str) -> LoggedScan:
    """``FLASER n r1 .. rn x y theta odom_x odom_y odom_theta time host logger_time``, half a turn from the right."""
    n = _count(words[1])
    ranges = [float(w) for w in words[2 : 2 + n]]
    rest = words[2 + n :]
    laser, robot = _pose(rest[0:3]), _pose(rest[3:6])
    # 180 beams are one degree apart and leave the last end out, 181 have one at either end.
    step = math.pi / (n if n % 2 == 0 else max(1, n - 1))
    angles = _Angles(-0.5 * math.pi, step, NO_RETURN)
    return _logged(kind, rest[6], ranges, angles, laser, robot)


def _full(words: list[str], kind: str) -> LoggedScan:
    """``ROBOTLASER1 type start fov step max accuracy mode n r.. m remission.. laser(3) robot(3) (5) time ..``."""
    angles = _Angles(float(words[2]), float(words[4]), float(words[5]))
    n = _count(words[8])
    ranges = [float(w) for w in words[9 : 9 + n]]
    rest = words[9 + n :]
    rest = rest[1 + _count(rest[0]) :]
    if kind.startswith("RAW"):
        return _logged(kind, rest[0], ranges, angles, None, None)
    return _logged(kind, rest[11], ranges, angles, _pose(rest[0:3]), _pose(rest[3:6]))


def _logged(
    kind: str,
    time: str,
    ranges: list[float],
    angles: _Angles,
    laser: RigidTransform | None,
    robot: RigidTransform | None,
) -> LoggedScan:
    mount = robot.inverse().compose(laser) if robot is not None and laser is not None else None
    # At the greatest range nothing came back: it has to lie above what counts as a return.
    scan = LaserScan(angles.first, angles.step, ranges, 0.0, math.nextafter(angles.range_max, 0.0))
    stamp = round(float(time) * 1e9)
    return LoggedScan(
        stamp, kind, kind, scan, 0.0, laser, "odom" if laser else "", mount, base_frame="robot" if mount else ""
    )


def _count(word: str) -> int:
    n = int(word)
    if n < 0:
        raise ValueError(f"expected a count of at least 0, found {n}")
    return n


def _pose(words: list[str]) -> RigidTransform:
    x, y, theta = (float(w) for w in words)
    return RigidTransform(x, y, theta)


READERS: dict[str, Callable[[list[str], str], LoggedScan]] = {
    "FLASER": _simple,
    "RLASER": _simple,
    "ROBOTLASER1": _full,
    "ROBOTLASER2": _full,
    "RAWLASER1": _full,
    "RAWLASER2": _full,
}
