"""Read scan files: JSON of a request, or a LaserScan message in JSON or in the YAML of ``ros2 topic echo``."""

from __future__ import annotations

import json
import math
import re
from typing import Any

from .errors import RefusedError
from .inputs import bytes_of, json_of, needing_formats
from .printing import Json

FORMS = ("laser", "points", "segments", "views")
CUT = "..."  # the last element of an array that `ros2 topic echo` has cut
LOST = re.compile(r"A message was lost!!!.*?---\s*\n", re.DOTALL)  # of `ros2 topic echo`
WORDS = {"inf": math.inf, "+inf": math.inf, "-inf": -math.inf, "nan": math.nan, "-nan": math.nan}  # of `rostopic echo`
OF_POSE = [("position", key) for key in "xyz"] + [("orientation", key) for key in "xyz"]
NEXT = "\n---"  # between the messages of `ros2 topic echo`


def read_scan(name: str) -> Json:
    """Read a scan file; ``-`` reads it from stdin.

    The bare fields of a LaserScan message become ``{"laser": ...}``. JSON may contain NaN and Infinity. Of several
    messages in YAML the first one is read.

    Raises
    ------
    WrongUseError
        When there is no such file, or it cannot be read.
    RefusedError
        When the content is neither JSON nor YAML, or no scan.
    """
    message = _parsed(bytes_of(name), name)
    if not isinstance(message, dict):
        raise RefusedError(f"{name}: found no scan; expected an object with one of {', '.join(FORMS)}, or a LaserScan")
    scan: Json = _unwrapped(message, name)
    if "ranges" in scan and not any(form in scan for form in FORMS):
        scan = {"laser": scan}
    for part in (scan, *_views(scan)):
        if isinstance(part.get("laser"), dict):
            part["laser"] = _finite(part["laser"], name)
    return scan


def _parsed(data: bytes, name: str) -> Any:
    """Return the content of JSON or YAML; text that begins with a bracket is JSON."""
    if data.lstrip()[:1] in (b"{", b"["):
        from linefix.documents.errors import NotJsonError, TooManyError

        try:
            return json_of(data)
        except (NotJsonError, TooManyError) as error:
            if "NaN and Infinity" in str(error):
                return json.loads(data)
            raise RefusedError(f"{name}: not JSON: {error}") from None
    with needing_formats(f"reading {name} as YAML"):
        from formats.yaml import yaml_of

        text = LOST.sub("", data.decode("utf-8", errors="replace")).removeprefix("---\n")
        return yaml_of(text.partition(NEXT)[0], name)


def _unwrapped(message: Json, name: str) -> Json:
    """Return the message in the envelope of rosbridge, and a LaserScan of Foxglove as one of ROS.

    Raises
    ------
    RefusedError
        When the scan of Foxglove is not in the frame of its sensor.
    """
    inner = message.get("msg")
    scan: Json = inner if isinstance(inner, dict) else message
    ranges = scan.get("ranges")
    if not (isinstance(ranges, list) and {"start_angle", "end_angle"} <= scan.keys()):
        return scan
    if any(scan.get("pose", {}).get(part, {}).get(key) for part, key in OF_POSE):
        raise RefusedError(
            f"{name}: is a foxglove.LaserScan with a pose in another frame; expected one in the frame of its sensor. "
            "Send the pose as a view"
        )
    step = (scan["end_angle"] - scan["start_angle"]) / max(1, len(ranges) - 1)
    return {"laser": {"angle_min": scan["start_angle"], "angle_increment": step, "ranges": ranges}}


def _views(scan: Json) -> list[Json]:
    views = scan.get("views")
    return [view for view in views if isinstance(view, dict)] if isinstance(views, list) else []


def _finite(laser: Json, name: str) -> Json:
    """Return a LaserScan as a request has it: null for an unknown range, twice the maximum for no return.

    An infinite `range_max` is unknown. Infinite ranges are then unknown, too. `intensities` are left out.

    Raises
    ------
    RefusedError
        When an array was cut.
    """
    laser = {field: value for field, value in laser.items() if field != "intensities"}
    ranges, most = laser.get("ranges"), laser.get("range_max")
    if isinstance(ranges, str):
        raise RefusedError(
            f"{name}: has no ranges, but '{ranges[:60]}'; expected numbers: record the scan without --noarr or --no-arr"
        )
    if not isinstance(ranges, list):
        return laser
    if ranges[-1:] == [CUT]:
        raise RefusedError(
            f"{name}: the ranges end in '...' after {len(ranges) - 1} values; expected all of them: "
            "record the scan with ros2 topic echo --full-length"
        )
    most = WORDS.get(most.lower(), most) if isinstance(most, str) else most
    if isinstance(most, float) and not math.isfinite(most):
        most = laser["range_max"] = None
    beyond = None if most is None else 2.0 * most
    laser["ranges"] = [_range(value, beyond) for value in ranges]
    return laser


def _range(value: Any, beyond: float | None) -> Any:
    value = WORDS.get(value.lower(), value) if isinstance(value, str) else value
    if not isinstance(value, float) or math.isfinite(value):
        return value
    return beyond if value == math.inf else None
