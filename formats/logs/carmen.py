"""Logs of CARMEN: one message a line, as the public logs of Radish and Freiburg have them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from registration import InputError, RigidTransform
from vectorization import LaserScan, require_angle_max

from ..errors import IncompleteFileError, MalformedFileError, TooLargeError
from ..files import BYTE_ORDER_MARK, WIDE, name_of
from ..limits import MAX_LINE_BYTES
from ..report import Notes
from .lasers import note_far
from .scan import Log, LoggedScan, LogOptions, Stamps, none_usable

SIMPLE = ("FLASER", "RLASER")
KINDS = (*SIMPLE, "ROBOTLASER1", "ROBOTLASER2", "RAWLASER1", "RAWLASER2")
MESSAGES = {"ODOM", "TRUEPOS", "PARAM", "SYNC", "NMEAGGA", "NMEARMC", *KINDS}
TRAILING = 9  # words behind the ranges of a simple message: two poses, two times and a host
NO_RETURN = 80.0  # m; what the range finders of these logs read, or more, where nothing came back

# Field of view, degrees, by the number of beams: SICK LMS 200 at 100 degrees, LMS 5xx at 190, Hokuyo URG-04LX, LMS 1xx,
# TiM 571 and UTM-30LX.
FIELDS_OF_VIEW = (
    {101: 100.0, 201: 100.0, 401: 100.0} | dict.fromkeys((191, 381, 571, 761, 1141), 190.0)
    | {681: 680 * 360 / 1024, 682: 681 * 360 / 1024, 683: 682 * 360 / 1024, 726: 725 * 360 / 1024, 769: 270.0}
    | dict.fromkeys((541, 811, 1081), 270.0) | {540: 269.5, 1080: 269.75}
)  # fmt: skip
HALF_TURN = (180, 181, 360, 361, 720, 721)  # beams of a scanner of 180 degrees
FINEST = 0.05  # degrees between beams; a PARAM below it is in radians
FEW_BEAMS = 100  # up to which the report has no note
USED = ("_laser_max", "_laser_resolution", "_laser_fov")  # the ends of the names of PARAM messages that are read


Settings = dict[str, str]
"""Values of the PARAM messages by name."""


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
        While iterating, when no scan is in it, or none that is whole.
    TooLargeError
        While iterating, when a line is too long.
    """
    return Log("carmen", name_of(path), partial(_scans, path, options))


def _scans(path: Path, options: LogOptions, notes: Notes) -> Iterator[LoggedScan]:
    wanted, stamps, first = options.topic, Stamps(notes), ""
    moves: bool | None = None
    seen: Counter[str] = Counter()
    settings: Settings = {}
    for number, words in _messages(path, notes):
        kind = words[0]
        seen[kind] += 1
        if kind == "PARAM" and len(words) > 2 and words[1].endswith(USED):
            settings[words[1]] = words[2]
            notes.add_read("settings", "PARAM messages of the laser", 1)
            continue
        if kind not in KINDS or (wanted is not None and kind != wanted):
            notes.add_dropped(f"message_{kind.lower()}", f"{kind} messages", 1)
            continue
        # The first kind of scan in the log is taken, so that a rear laser is not mixed with the front one.
        if wanted is None:
            wanted = kind
            notes.add_assumed("topic", f"scans are those of {kind}, the first kind in the log")
        try:
            scan = _scan_of(words, settings, notes)
        except InputError as error:
            first = first or error.message
            notes.add_dropped("broken_scan", f"scans that cannot be used, such as: {error.message}", 1)
            continue
        except (ValueError, LookupError, OverflowError):
            first = first or f"line {number} is no {kind} message: check the number of its ranges, and decimal points"
            notes.add_dropped("broken_line", f"broken lines, the last at {number}", 1)
            continue
        note_far(scan.laser, notes)
        stamps.of(scan.stamp_ns)
        notes.add_read("scans", f"{kind} scans", 1)
        moves = _moves(path, kind, settings) if moves is None else moves
        if not moves:
            told = "in all scans the robot is at 0, 0, 0" if scan.pose is not None else f"{kind} messages have no pose"
            notes.add_assumed("no_odometry", f"no odometry was found: {told}")
            scan = replace(scan, pose=None, pose_frame="")
        yield stamps.placed(scan)
    if "scans" not in notes.read and first:
        raise none_usable(notes, first)
    if "scans" not in notes.read:
        there = ", ".join(f"{count} {kind}" for kind, count in sorted(seen.items())) or "no message of CARMEN"
        raise IncompleteFileError(f"has no {wanted or 'scan'}; it has {there}")


def _moves(path: Path, kind: str, settings: Settings) -> bool:
    """Tell whether the robot is anywhere but at 0, 0, 0 in the scans of a kind, up to the first such scan."""
    for _, words in _messages(path, Notes()):
        if words[0] != kind:
            continue
        try:
            scan = _scan_of(words, settings, Notes())
        except (InputError, ValueError, LookupError, OverflowError):
            continue
        if scan.pose != scan.mount:
            return True
    return False


def _messages(path: Path, notes: Notes) -> Iterator[tuple[int, list[str]]]:
    with path.open("rb") as file:
        number = 0
        while line := file.readline(MAX_LINE_BYTES + 1):
            number += 1
            if len(line) > MAX_LINE_BYTES:
                raise TooLargeError(f"line {number}: expected at most {MAX_LINE_BYTES} bytes")
            if number == 1 and line.startswith(WIDE):
                raise MalformedFileError("is text in UTF-16; save it as UTF-8")
            words = line.removeprefix(BYTE_ORDER_MARK if number == 1 else b"").decode("ascii", "replace").split()
            if not words or words[0].startswith("#"):
                continue
            if words[0] in MESSAGES:
                yield number, words
            else:
                notes.add_dropped("other_lines", "lines that are not messages of CARMEN", 1)


def _scan_of(words: list[str], settings: Settings, notes: Notes) -> LoggedScan:
    return _simple(words, settings, notes) if words[0] in SIMPLE else _full(words)


def _simple(words: list[str], settings: Settings, notes: Notes) -> LoggedScan:
    """``FLASER n r1 .. rn x y theta odom_x odom_y odom_theta time host logger_time``, ahead in the middle."""
    n = _count(words[1])
    ranges = [float(w) for w in words[2 : 2 + n]]
    rest = words[2 + n :]
    if len(rest) > TRAILING:
        raise ValueError(f"found {len(rest)} words after the ranges, expected at most {TRAILING}")
    laser, robot = _pose(rest[0:3]), _pose(rest[3:6])
    side = "rear" if words[0] == "RLASER" else "front"
    most = _setting(settings, f"robot_{side}_laser_max") or NO_RETURN
    first, step = _field_of_view(n, settings, side, notes)
    return _logged(words[0], rest[6], ranges, _Angles(first, step, min(most, NO_RETURN)), laser, robot)


def _field_of_view(n: int, settings: Settings, side: str, notes: Notes) -> tuple[float, float]:
    """Return the first angle and the step of n beams, radians: by the settings of the log, else by n."""
    step = _setting(settings, f"laser_{side}_laser_resolution")
    field = _setting(settings, f"laser_{side}_laser_fov")
    why, spaces = "by the PARAM of the log", max(1, n - 1)
    if 0.0 < (step or (field or 0.0) / spaces) < FINEST:
        step, field = step and math.degrees(step), field and math.degrees(field)
        why += ", which has radians"
    if step and field and min(abs(n * step - field), abs((n - 1) * step - field)) > 1.5 * step:
        why, step, field = f"because its PARAM {field:g} and {step:g} degrees contradict each other", None, None
    elif step and field is None:
        field = n * step if n % 2 == 0 and n * step in (180.0, 360.0) else (n - 1) * step
    elif not (step or field):
        why = "by the number of ranges"
    remedy = f"put a line such as `PARAM laser_{side}_laser_fov 240`, in degrees, in front of the scans"
    if "contradict" in why:
        remedy = f"correct the lines `PARAM laser_{side}_laser_fov` and `PARAM laser_{side}_laser_resolution`"
    if not (step or field or n in FIELDS_OF_VIEW or n in HALF_TURN or n <= FEW_BEAMS):
        raise IncompleteFileError(
            f"found {n} ranges, whose field of view neither a PARAM nor the number of ranges says, expected a known "
            f"scanner; {remedy}",
            argument="ranges",
        )
    if n not in FIELDS_OF_VIEW and n % 2 == 0 and field in (None, n * step if step else field):
        spaces = n  # the last end is left out: 180 beams are one degree apart, 181 have one at either end
    field = field or FIELDS_OF_VIEW.get(n, 180.0)
    if field != 180.0 or (n > FEW_BEAMS and n not in HALF_TURN):
        notes.add_assumed("field_of_view", f"scans of {n} ranges over {field:.4g} degrees, {why}", 1)
    return -0.5 * math.radians(field), math.radians(step or field / spaces)


def _setting(settings: Settings, name: str) -> float | None:
    try:
        value = float(settings[name])
    except (LookupError, ValueError):
        return None
    return value if 0.0 < value <= 360.0 else None


def _full(words: list[str]) -> LoggedScan:
    """``ROBOTLASER1 type start fov step max accuracy mode n r.. m remission.. laser(3) robot(3) (5) time ..``."""
    angles = _Angles(float(words[2]), float(words[4]), float(words[5]))
    n, field = _count(words[8]), float(words[3])
    if field > 0.0:
        require_angle_max(angles.first, angles.first + field, angles.step, n)
    ranges = [float(w) for w in words[9 : 9 + n]]
    rest = words[9 + n :]
    rest = rest[1 + _count(rest[0]) :]
    if words[0].startswith("RAW"):
        return _logged(words[0], rest[0], ranges, angles, None, None)
    return _logged(words[0], rest[11], ranges, angles, _pose(rest[0:3]), _pose(rest[3:6]))


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
    return RigidTransform(x, y, math.remainder(theta, math.tau))  # odometry counts turns
