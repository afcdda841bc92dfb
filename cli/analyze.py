"""``linefix analyze``: places of a map where a robot would not find its pose."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

from .asking import Where, setting
from .errors import Names, WrongUseError, flags_of, needing
from .inputs import draw_picture, read_map_file, read_map_or_id
from .options import MapArgument, grouped, option
from .printing import Json, Output, compile_first, progress, rows, write_json

SUFFIXES = (".json", ".geojson")


@dataclass(frozen=True, slots=True)
class ScannerOptions:
    """The scanner that the robot has, as options."""

    fov: float = option(6.283185307179586, "Field of view of the scanner.", "RADIANS")
    beams: int = option(720, "Number of beams in the field of view.", "N")
    range_max: float = option(20.0, "Maximum range of the scanner.", "METRES")
    sigma: float = option(0.02, "Standard deviation of the ranges.", "METRES")


@dataclass(frozen=True, slots=True)
class PlaceOptions:
    """The places to analyze, what is analyzed of each, and the time for it, as options."""

    spacing: float | None = option(None, "Distance between places. Default: about 400 places.", "METRES")
    point: tuple[float, float] | None = option(None, "Analyze only places connected with this one.", "X Y")
    drive: float = option(0.0, "Maximum distance to drive until the pose is usable, at most 30.", "METRES")
    landmark: str | None = option(None, "Map file of a landmark's walls: repeat the analysis with it.", "FILE")
    deadline_ms: float | None = option(None, "Time limit of the analysis.", "MS")


@grouped
def analyze(
    on: MapArgument,
    scanner: ScannerOptions,
    places: PlaceOptions,
    where: Where,
    output: Output,
    out: Path | None = option(None, "Write the result as .json or .geojson.", "FILE"),
    picture: Path | None = option(None, "Draw the result on the map as .png.", "FILE"),
) -> None:
    """Simulate scans on a grid of poses and report where localization succeeds."""
    if out is not None and out.suffix.lower() not in SUFFIXES:
        raise WrongUseError(f"--out: found {out.name}, expected a name that ends in {' or '.join(SUFFIXES)}")
    target = read_map_or_id(on)
    names = flags_of(scanner, "/laser") | flags_of(places) | {"/map": on}
    body = {"map": target, "laser": asdict(scanner), **asdict(places), "point": places.point and list(places.point)}
    body["landmark"] = [] if places.landmark is None else read_map_file(places.landmark).get("segments", [])
    answer = _analyzed(body, names, where)
    if out is not None:
        write_json(answer if out.suffix.lower() == ".json" else features(answer), out)
    if picture is not None:
        _draw(where.whole_map(target), answer, picture)
    output.print(answer, rows(_rows(answer)))


def _analyzed(body: Json, names: Names, where: Where) -> Json:
    """Return the answer of ``POST /v1/analyze``: of a server, or worked out here on all cores."""
    if where.server is not None:
        return where.ask("analyze", body, names=names)
    compile_first()
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    with progress() as show:
        here = {"cores": setting("SEARCHES", cores), "progress": partial(show, "places")}
        return where.ask("analyze", body, names=names, **here)


def features(answer: Json) -> Json:
    """Return an analysis as GeoJSON: a point for each pose, in the map's own metres."""
    found = []
    for place in answer["places"]:
        pose, rest = place["pose"], {name: value for name, value in place.items() if name != "pose"}
        where = {"type": "Point", "coordinates": [pose["x"], pose["y"]]}
        found.append({"type": "Feature", "geometry": where, "properties": {"theta": pose["theta"], **rest}})
    return {"type": "FeatureCollection", "features": found}


def _draw(document: Json, answer: Json, picture: Path) -> None:
    with needing("drawing"):
        from formats import VERDICTS, PlaceMark, rgb, verdict_of

    marks = [
        PlaceMark(one["pose"]["x"], one["pose"]["y"], answer["spacing"], rgb(VERDICTS[kind]))
        for one in answer["places"]
        for kind in [verdict_of(one["status"], usable=one["usable"])]
    ]
    draw_picture(document, picture, marks=marks)


def _rows(answer: Json) -> Iterator[tuple[str, str]]:
    counts = answer["summary"]
    share = 100.0 * counts["usable"] / counts["places"] if counts["places"] else 0.0
    yield "places", f"{counts['places']} poses, {answer['spacing']:g} m apart, {counts['not_free']} more are not free"
    simulated = "simulated without people, and without furniture that is not on the map"
    yield "usable", f"{counts['usable']} ({share:.0f} %), {simulated}"
    if counts.get("resolved_within") is not None:
        yield "driven", f"{counts['resolved_within']} are usable at once or after a drive"
    if counts.get("usable_with_landmark") is not None:
        yield "landmark", f"{counts['usable_with_landmark']} usable with the landmark"
    for status in ("ambiguous", "degenerate", "no_match"):
        if counts[status]:
            twins = f", {counts['similar_pose']} of them with a similar place" if status == "ambiguous" else ""
            yield status, f"{counts[status]}{twins}"
    if not answer["complete"]:
        yield "left out", f"{counts['left_out']}, the time limit ended the analysis"
