"""``linefix map update``: changes of a building, found in the scans of several visits."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Annotated

import typer

from .. import asking
from ..errors import WrongUseError
from ..inputs import line_map_of, needing_formats, read_map_or_id
from ..logs import TfNamespace, Topic, opened, options_of, print_notes, scans_of, sent, spread
from ..options import AsJson, MapArgument, Picture, Server, grouped
from ..printing import Json, print_json, print_rows
from .drawing import write_document

if TYPE_CHECKING:
    from formats import LoggedScan

SCANS = 200  # of a log; more cost time, and say the same again


@dataclass(frozen=True, slots=True)
class ChangeOptions:
    """Which changes to accept."""

    accept: Annotated[
        float | None,
        typer.Option(
            metavar="CONFIDENCE", min=0.0, max=1.0, help="Leave changes of less confidence out. Default: accept all."
        ),
    ] = None
    refuse: Annotated[
        list[int] | None, typer.Option(metavar="INDEX", help="Leave this change out; repeat for more changes.")
    ] = None


@dataclass(frozen=True, slots=True)
class LogOptions:
    """Which scans to read of each log."""

    scans: Annotated[int, typer.Option(metavar="N", min=3, help="Use so many scans of each log at most.")] = SCANS
    topic: Topic = None
    tf_namespace: TfNamespace = None


@grouped
def update(
    on: MapArgument,
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="A log of each visit; changes need two visits.")],
    *,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write the new map to this file: json, dxf, svg, geojson or csv."),
    ] = None,
    picture: Picture = None,
    changes: ChangeOptions,
    source: LogOptions,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Propose changes of a map that the scans of several visits show, and write the new map."""
    target = read_map_or_id(on)
    visits = dict(zip(visit_names(logs), (_scans(log, source) for log in logs), strict=True))
    answer = asking.update(target, _request_of(visits, changes), server)
    if out is not None:
        write_document(answer["map"], out)
    if picture is not None:
        draw_changes(asking.whole_map(target, server), answer, picture)
    if as_json:
        print_json(answer)
    else:
        print_rows(list(update_rows(answer)))


def _request_of(visits: Mapping[str, Sequence[LoggedScan]], changes: ChangeOptions) -> Json:
    """Return a request for an update; poses are those of the sensor, so that mounts make no difference."""
    sent_visits = [{"visit": name, "scans": [_sent(one) for one in scans]} for name, scans in visits.items()]
    request: Json = {"visits": sent_visits, "refuse": changes.refuse or []}
    return request if changes.accept is None else {**request, "accept": changes.accept}


def _sent(one: LoggedScan) -> Json:
    """Return a scan of a log as a request for an update has it."""
    view = sent(replace(one, mount=None))["views"][0]
    told: Json = {name: view[name] for name in ("laser", "twist", "flipped") if name in view}
    if one.pose is not None:
        told["odometry"] = {"x": one.pose.x, "y": one.pose.y, "theta": one.pose.theta}
    return told


def visit_names(logs: list[Path]) -> list[str]:
    """Return a name for each visit: that of its log.

    Raises
    ------
    WrongUseError
        When a log is there twice.
    """
    if len({log.resolve() for log in logs}) < len(logs):
        raise WrongUseError("LOG: found the same log twice, expected a log of each visit")
    names = [log.name for log in logs]
    return names if len(set(names)) == len(names) else [str(log) for log in logs]


def _scans(log: Path, source: LogOptions) -> list[LoggedScan]:
    """Return some scans of a log, evenly over all of it; print on stderr what was made of the log."""
    read = opened(log, options_of(source.topic, source.tf_namespace))
    taken = thinned(scans_of(read), source.scans)
    print_notes(read, sys.stderr)
    # Odometry connects the scans of one part only: that with most of them.
    most = Counter(one.part for one in taken).most_common(1)
    return [one if one.part == most[0][0] else replace(one, pose=None) for one in taken]


def thinned(found: Iterable[LoggedScan], most: int) -> list[LoggedScan]:
    """Return so many, evenly over all, without all of them in memory; all of them where there are no more."""
    kept: list[LoggedScan] = []
    step = 1
    for number, one in enumerate(found):
        if number % step:
            continue
        kept.append(one)
        if len(kept) > 4 * most:
            kept, step = kept[::2], 2 * step
    return spread(kept, most)


def update_by_drive(document: Json, log: Path) -> Json:
    """Return the update of a map by one log; its halves count as two visits.

    Raises
    ------
    RefusedError
        When the log, or a scan, is not taken.
    """
    scans = _scans(log, LogOptions(scans=2 * SCANS))
    half = len(scans) // 2
    halves = {"first half": scans[:half], "second half": scans[half:]}
    return asking.update(document, _request_of(halves, ChangeOptions()), None)


def update_rows(answer: Json) -> Iterator[tuple[str, str]]:
    """Yield a proposal as text for people."""
    for one in answer["refused_visits"]:
        yield "visit", f"{one['visit']} gives no evidence: {one['message']}"
    for number, one in enumerate(answer["changes"]):
        told = one["evidence"]
        kept = "" if one["accepted"] else ", not accepted"
        old = f" segments {', '.join(map(str, one['segments'][:8]))}{', ...' * (len(one['segments']) > 8)}"
        new = f" {len(one['new'])} new"
        yield (
            f"change {number}",
            f"{one['code']}{old * bool(one['segments'])}{new * bool(one['new'])}: confidence {one['confidence']:.4f}, "
            f"{told['poses']} poses, {told['visits']} visits, {told['beams_through']} beams through, "
            f"{told['beams_on']} on{kept}",
        )
    if not answer["changes"]:
        yield "change", "none"
    sharp = answer["sharpened"]["sigma"]
    if sharp:
        yield (
            "sharper",
            f"{len(sharp)} walls at better positions, sigma {1e3 * median(sharp):.1f} mm (median)",
        )
    held = answer["held_back"]
    yield "scans", f"{answer['usable_before']} of {answer['scans']} usable before, {answer['usable_after']} after"
    yield (
        "held back",
        f"{held['usable_before']} of {held['scans']} usable before, {held['usable_after']} after; "
        "they gave no evidence",
    )
    if not answer["complete"]:
        yield "note", "the time limit ended the update; changes that were not verified are not proposed"


def draw_changes(old: Json, answer: Json, picture: Path) -> None:
    """Draw the old map, and the changes in colours: old walls that go dashed, new walls solid."""
    with needing_formats("drawing a picture"):
        import numpy as np

        from formats import draw_map
        from formats.colours import CHANGES, rgb
        from formats.picture import DrawnLines

        line_map = line_map_of(old)
        ends = line_map.segments.endpoints
        lines = []
        for code, colour in CHANGES.items():
            mine = [one for one in answer["changes"] if one["code"] == code]
            gone = [ends[k] for one in mine for k in one["segments"] if code != "extended"]
            new = [one["segment"] for change in mine for one in change["new"]]
            lines.append(DrawnLines(np.array(new).reshape(-1, 4), rgb(colour), code))
            name = code if code == "removed" else f"{code}, before"
            lines.append(DrawnLines(np.array(gone).reshape(-1, 4), rgb(colour), name, dashed=True))
        draw_map(line_map, picture, lines=lines)
