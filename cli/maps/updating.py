"""``linefix map update``: changes of a building, found in the scans of several visits."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean, median, mode
from typing import TYPE_CHECKING, Annotated

from ..asking import Where
from ..errors import WrongUseError, flags_of, needing
from ..inputs import draw_picture, line_map_of, read_map_or_id
from ..logs import some_scans
from ..options import DRAW_RESULT, WRITE_MAP, MapArgument, TopicOptions, argument, grouped, option
from ..printing import Json, Output, rows, write_json
from .checking import of_sensor

if TYPE_CHECKING:
    from formats import LoggedScan

SCANS = 200  # of a log; more cost time, and say the same again
SHOWN = 8  # segments of a change


@dataclass(frozen=True, slots=True)
class Result:
    """Which changes to accept, and files for the new map."""

    accept: float | None = option(None, "Leave changes of less confidence out.", "CONFIDENCE", min=0.0, max=1.0)
    refuse: list[int] | None = option(None, "Leave this change out; repeat for more changes.", "INDEX")
    out: Path | None = option(None, WRITE_MAP, "FILE")
    picture: Path | None = option(None, DRAW_RESULT, "FILE")


@grouped
def update(
    on: MapArgument,
    logs: Annotated[list[Path], argument("A log of each visit; changes need two visits.", "LOG")],
    source: TopicOptions,
    result: Result,
    where: Where,
    output: Output,
) -> None:
    """Propose changes of a map that the scans of several visits show, and write the new map."""
    target, scans = read_map_or_id(on), _visits_of(logs, source)
    names = flags_of(result) | {"": on, "/map": on}
    names |= {f"/visits/{number}": name for number, name in enumerate(scans)}
    visits = [{"visit": name, "scans": [_sent(one) for one in some]} for name, some in scans.items()]
    request = {"visits": visits, "accept": result.accept, "refuse": result.refuse or []}
    answer = where.ask("update_map", target, request, names=names)
    if result.out is not None:
        write_json(answer["map"], result.out)
    old = where.whole_map(target)
    if result.picture is not None:
        draw_changes(old, answer, result.picture)
    output.print(answer, rows(update_rows(answer, old, len(scans))))


def _visits_of(logs: Sequence[Path], source: TopicOptions) -> dict[str, list[LoggedScan]]:
    """Return scans of each visit, by the name of its log.

    Odometry connects the scans of one part of a log: scans of other parts than the longest are without it.

    Raises
    ------
    WrongUseError
        When a log is there twice.
    """
    if len({log.resolve() for log in logs}) < len(logs):
        raise WrongUseError("LOG: found the same log twice, expected a log of each visit")
    same = len({log.name for log in logs}) < len(logs)
    found: dict[str, list[LoggedScan]] = {}
    for log in logs:
        taken = some_scans(log, SCANS, source)
        longest = mode(one.part for one in taken)
        found[str(log) if same else log.name] = [
            one if one.part == longest else replace(one, pose=None) for one in taken
        ]
    return found


def _sent(one: LoggedScan) -> Json:
    """Return a scan of a log as a request for an update has it: of the sensor, so that mounts make no difference."""
    view = of_sensor(one)["views"][0]
    told: Json = {name: view[name] for name in ("laser", "twist", "flipped") if name in view}
    if one.pose is not None:
        told["odometry"] = {"x": one.pose.x, "y": one.pose.y, "theta": one.pose.theta}
    return told


def update_rows(answer: Json, old: Json, visits: int = 2) -> Iterator[tuple[str, str]]:
    """Yield a proposal of changes to a map, by so many visits, as text for people."""
    for one in answer["refused_visits"]:
        yield "visit", f"{one['visit']} gives no evidence: {one['message']}"
    for number, one in enumerate(answer["changes"]):
        told = one["evidence"]
        kept = "" if one["accepted"] else ", not accepted"
        before, after = [old["segments"][k] for k in one["segments"]], [new["segment"] for new in one["new"]]
        x, y = _middle((*before, *after))
        which = f" (segments {_some(one['segments'])})" * bool(before)
        yield (
            f"change {number}",
            f"{one['code']} near ({x:.1f}, {y:.1f}): {_metres(before)}{which} before, {_metres(after)} after; "
            f"confidence {one['confidence']:.4f}, {told['poses']} poses, {told['visits']} visits, "
            f"{told['beams_through']} beams through, {told['beams_on']} on{kept}",
        )
    if not answer["changes"]:
        yield "change", "none" + ("; a change needs logs of two visits" if visits < 2 else "")
    for one in answer["kept"]:
        yield "kept", f"segments {_some(one['segments'])}: {one['message']}"
    sharp = answer["sharpened"]["sigma"]
    if sharp:
        yield "sharper", f"{len(sharp)} walls at better positions, sigma {1e3 * median(sharp):.1f} mm (median)"
    for name, of, more in (("scans", answer, ""), ("held back", answer["held_back"], "; they gave no evidence")):
        yield name, f"{of['usable_before']} of {of['scans']} usable before, {of['usable_after']} after{more}"
    if not answer["complete"]:
        yield "note", "the time limit ended the update; changes that were not verified are not proposed"


def _some(segments: Sequence[int]) -> str:
    """Return the first indices of segments."""
    return ", ".join(map(str, segments[:SHOWN])) + ", ..." * (len(segments) > SHOWN)


def _middle(rows: Sequence[Sequence[float]]) -> tuple[float, float]:
    """Return the mean of the ends of segments, where the number of their change stands on the picture."""
    return fmean(x for row in rows for x in row[::2]), fmean(y for row in rows for y in row[1::2])


def _metres(rows: Sequence[Sequence[float]]) -> str:
    """Return the length of segments."""
    return f"{sum(math.dist(row[:2], row[2:]) for row in rows):.2f} m"


def draw_changes(old: Json, answer: Json, picture: Path) -> None:
    """Draw the old map, and the changes in colours with their numbers: old walls that go dashed, new walls solid."""
    with needing("drawing a picture"):
        import numpy as np

        from formats.colours import CHANGES, rgb
        from formats.picture import DrawnLines, DrawnText

        ends = line_map_of(old).segments.endpoints
    lines = []
    for code, colour in CHANGES.items():
        mine = [one for one in answer["changes"] if one["code"] == code]
        gone = [ends[k] for one in mine for k in one["segments"] if code != "extended"]
        new = [one["segment"] for change in mine for one in change["new"]]
        lines.append(DrawnLines(np.array(new).reshape(-1, 4), rgb(colour), code))
        name = code if code == "removed" else f"{code}, before"
        lines.append(DrawnLines(np.array(gone).reshape(-1, 4), rgb(colour), name, dashed=True))
    texts = []
    for number, one in enumerate(answer["changes"]):
        x, y = _middle([*(old["segments"][k] for k in one["segments"]), *(new["segment"] for new in one["new"])])
        texts.append(DrawnText(x, y, str(number), rgb(CHANGES[one["code"]])))
    draw_picture(old, picture, lines=lines, texts=texts)
