"""Files of JSON, and of scans: JSON of a request, or a LaserScan as JSON or as ``ros2 topic echo`` prints it."""

from __future__ import annotations

import json
import math
import re
import sys
from pathlib import Path
from typing import Any

from .errors import RefusedError, WrongUseError, needing
from .printing import Json

STDIN = "-"
BYTE_ORDER_MARK = b"\xef\xbb\xbf"  # that some editors put in front of UTF-8
MAX_VALUES = 1_000_000_000  # of a file; what a request may hold is the service's business
LOGS = (".bag", ".mcap", ".db3", ".clf", ".log")
FORMS = ("laser", "points", "segments", "views")
CUT = "..."  # the last element of an array that `ros2 topic echo` has cut
LOST = re.compile(r"A message was lost!!!.*?---\s*\n", re.DOTALL)  # of `ros2 topic echo`
WARNINGS = re.compile(r"\A(\s*\[?(WARN|WARNING|INFO)\b.*\n)+")  # of the tools of ROS, before the message
NEXT = "\n---"  # between the messages of `ros2 topic echo`


def bytes_of(name: str) -> bytes:
    """Return the content of a text file without a byte-order mark; ``-`` reads stdin; raises `OSError`."""
    data = sys.stdin.buffer.read() if name == STDIN else Path(name).read_bytes()
    return data.removeprefix(BYTE_ORDER_MARK)


def read_json(name: str, data: bytes | None = None) -> Any:
    """Return the content of a file of JSON; `data` is its content where it is read already, with NaN and Infinity.

    Raises
    ------
    OSError
        As `bytes_of`.
    RefusedError
        When it is not JSON, or has more values than any request may have.
    """
    from linefix.documents.errors import NotJsonError, TooManyError
    from linefix.documents.limits import Limits
    from linefix.documents.reading import parse

    try:
        return parse(bytes_of(name) if data is None else data, Limits(values=MAX_VALUES))
    except (NotJsonError, TooManyError) as error:
        if data is not None and "NaN and Infinity" in str(error):
            return json.loads(data)
        raise RefusedError(f"{name}: not JSON: {error}") from None


def read_scan(name: str) -> Json:
    """Read a scan file; ``-`` reads it from stdin.

    The bare fields of a LaserScan message become ``{"laser": ...}``. JSON may contain NaN and Infinity. Of several
    messages in YAML the first one is read.

    Raises
    ------
    OSError
        As `bytes_of`.
    WrongUseError
        When it is a log.
    RefusedError
        When the content is neither JSON nor YAML, or no scan.
    """
    if Path(name).suffix.lower() in LOGS or Path(name).is_dir():
        raise WrongUseError(
            f"{name}: is a log or a folder, expected one scan; linefix replay LOG --map MAP localizes scans of a log"
        )
    data = bytes_of(name)
    message = read_json(name, data) if data.lstrip()[:1] in (b"{", b"[") else _yaml(data, name)
    if not isinstance(message, dict):
        raise RefusedError(f"{name}: found no scan; expected an object with one of {', '.join(FORMS)}, or a LaserScan")
    # The envelope of rosbridge, or of Foxglove.
    inner = message.get("msg", message.get("message"))
    if isinstance(inner, str) and inner.lstrip().startswith("{"):
        inner = read_json(name, inner.encode())
    scan: Json = inner if isinstance(inner, dict) else message
    if "ranges" in scan and not any(form in scan for form in FORMS):
        scan = {"laser": scan}
    views = scan.get("views")
    for part in (scan, *(views if isinstance(views, list) else [])):
        if isinstance(part, dict) and isinstance(part.get("laser"), dict):
            part["laser"] = _finite(part["laser"], name)
    return scan


def _yaml(data: bytes, name: str) -> Any:
    """Return the first message of YAML."""
    with needing(f"reading {name} as YAML"):
        from formats.errors import naming
        from formats.files import load_yaml

        text = WARNINGS.sub("", LOST.sub("", data.decode("utf-8", errors="replace")), count=1).removeprefix("---\n")
        with naming(name):
            return load_yaml(text.partition(NEXT)[0])


def _finite(laser: Json, name: str) -> Json:
    """Return a LaserScan as a request has it: null for an unknown range, twice the maximum for no return.

    An infinite `range_max` is unknown. Infinite ranges are then unknown, too. `intensities` are left out.

    Raises
    ------
    RefusedError
        When an array was cut.
    """
    laser = {field: value for field, value in laser.items() if field != "intensities"}
    ranges = laser.get("ranges")
    ranges = [CUT] if isinstance(ranges, str) else ranges  # such as '<array type: float32>'
    if not isinstance(ranges, list):
        return laser
    if ranges[-1:] == [CUT]:
        raise RefusedError(
            f"{name}: the ranges end after {len(ranges) - 1} values, expected all of them: record the scan with "
            "ros2 topic echo --full-length, and without --noarr"
        )
    laser |= {field: _number(value) for field, value in laser.items() if field.startswith(("angle_", "range_"))}
    most = laser.get("range_max")
    if isinstance(most, float) and not math.isfinite(most):
        most = laser["range_max"] = None
    known = {math.inf: None if most is None else 2.0 * most}
    read = map(_number, ranges)
    laser["ranges"] = [known.get(r) if isinstance(r, float) and not math.isfinite(r) else r for r in read]
    return laser


def _number(value: Any) -> Any:
    """Return the number that a text stands for, as of `rostopic echo` or in quotes; anything else as it is."""
    try:
        return float(value) if isinstance(value, str) else value
    except ValueError:
        return value
