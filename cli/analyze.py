"""``linefix analyze``: places of a map where a robot would not find its pose."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import typer

from .asking import answering, id_of, server_at, setting
from .errors import Asked, RefusedError, WrongUseError
from .inputs import line_map_of, needing_formats, read_map_file, read_map_or_id
from .options import AsJson, MapArgument, Server, grouped
from .printing import Json, print_json, print_rows, write_json

SUFFIXES = (".json", ".geojson")
OPTION = re.compile(r"(?:/laser)?/(fov|beams|range_max|sigma|spacing|point|drive|landmark)\b[^:]*")


@dataclass(frozen=True, slots=True)
class ScannerOptions:
    """The scanner that the robot has, as options."""

    fov: Annotated[float, typer.Option(metavar="RADIANS", help="Field of view of the scanner.")] = 6.283185307179586
    beams: Annotated[int, typer.Option(metavar="N", help="Number of beams in the field of view.")] = 720
    range_max: Annotated[float, typer.Option(metavar="METRES", help="Maximum range of the scanner.")] = 20.0
    sigma: Annotated[float, typer.Option(metavar="METRES", help="Standard deviation of the ranges.")] = 0.02


@dataclass(frozen=True, slots=True)
class FurtherOptions:
    """Further questions about each place, as options."""

    drive: Annotated[
        float, typer.Option(metavar="METRES", help="Maximum distance to drive until the pose is usable, at most 30.")
    ] = 0.0
    landmark: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="Map file with the walls of a landmark: repeat the analysis with it."),
    ] = None


@dataclass(frozen=True, slots=True)
class PlaceOptions:
    """The places to analyze, and the time for them, as options."""

    spacing: Annotated[
        float | None,
        typer.Option(metavar="METRES", help="Distance between places. Default: about 400 places on the map."),
    ] = None
    point: Annotated[
        tuple[float, float] | None,
        typer.Option(metavar="X Y", help="Analyze only places that are connected with this one."),
    ] = None
    deadline_ms: Annotated[float | None, typer.Option(metavar="MS", help="Time limit of the analysis.")] = None


@grouped
def analyze(
    on: MapArgument,
    scanner: ScannerOptions,
    further: FurtherOptions,
    places: PlaceOptions,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the result as .json or .geojson.")] = None,
    picture: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the result on the map as .png.")] = None,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Simulate scans on a grid of poses and report where localization succeeds."""
    if out is not None and out.suffix.lower() not in SUFFIXES:
        raise WrongUseError(f"--out: found {out.name}, expected a name that ends in {' or '.join(SUFFIXES)}")
    target = read_map_or_id(on)
    if picture is not None and "map_id" in target:
        raise WrongUseError(
            "--picture: found the id of a stored map, expected a map file; write one with linefix map get ID --out FILE"
        )
    landmark = [] if further.landmark is None else read_map_file(further.landmark).get("segments", [])
    body: Json = {"map": target, "laser": asdict(scanner), "drive": further.drive, "landmark": landmark}
    body |= {"spacing": places.spacing, "deadline_ms": places.deadline_ms}
    if places.point is not None:
        body["point"] = list(places.point)
    answer = _analyzed(body, server)
    if out is not None:
        write_json(answer if out.suffix.lower() == ".json" else features(answer), out)
    if picture is not None:
        _draw(read_map_file(on), answer, picture)
    if as_json:
        print_json(answer)
    else:
        print_rows(list(_rows(answer)))


def _analyzed(body: Json, server: str | None) -> Json:
    """Return the answer of ``POST /v1/analyze``: of a server, or worked out here on all cores."""
    deadline = body["deadline_ms"]
    if deadline is not None and not deadline >= 0.0:
        raise WrongUseError(f"--deadline-ms: expected milliseconds from 0 on, found {deadline:g}")
    if server is not None:
        with server_at(server) as remote:
            return remote.call("AnalyzeAnswer", "analyze", body)
    try:
        with answering(Asked(id_of(body["map"]))) as within, _progress() as progress:
            from linefix.answering import analyze as analyze_here

            return analyze_here(body, within, cores_here(), progress)
    except RefusedError as error:
        named = OPTION.sub(lambda found: "--" + found[1].replace("_", "-"), str(error), count=1)
        raise RefusedError(named, error.pointer) from None


def cores_here() -> int:
    """Return how many processes analyze: by the environment, else one for each core."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return setting("SEARCHES", cores)


@contextmanager
def _progress() -> Iterator[Callable[[int, int], None]]:
    """Show the progress on a terminal; never in piped output."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = TextColumn("places"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    with Bar(*columns, console=Console(stderr=True), disable=not sys.stderr.isatty(), transient=True) as bar:
        task = bar.add_task("places", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def features(answer: Json) -> Json:
    """Return an analysis as GeoJSON: a point for each pose, in the map's own metres."""
    found = []
    for place in answer["places"]:
        pose, rest = place["pose"], {name: value for name, value in place.items() if name != "pose"}
        found.append(
            {
                "type": "Feature",
                "geometry": {"type": "Point", "coordinates": [pose["x"], pose["y"]]},
                "properties": {"theta": pose["theta"], **rest},
            }
        )
    return {"type": "FeatureCollection", "features": found}


def _draw(document: Json, answer: Json, picture: Path) -> None:
    with needing_formats("drawing"):
        from formats import VERDICTS, PlaceMark, draw_map, rgb, verdict_of

        marks = [
            PlaceMark(one["pose"]["x"], one["pose"]["y"], answer["spacing"], rgb(VERDICTS[kind]))
            for one in answer["places"]
            for kind in [verdict_of(one["status"], usable=one["usable"])]
        ]
        draw_map(line_map_of(document), picture, marks=marks)


def _rows(answer: Json) -> Iterator[tuple[str, str]]:
    counts = answer["summary"]
    share = 100.0 * counts["usable"] / counts["places"] if counts["places"] else 0.0
    yield "places", f"{counts['places']} poses, {answer['spacing']:g} m apart, {counts['not_free']} more are not free"
    yield (
        "usable",
        f"{counts['usable']} ({share:.0f} %), simulated without people, and without furniture that is not on the map",
    )
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
