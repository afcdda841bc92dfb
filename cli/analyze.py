"""``linefix analyze``: places of a map where a robot would not find its pose."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

from .asking import Where
from .errors import flags_of, needing
from .inputs import draw_picture, read_map_file, read_map_or_id
from .options import MapArgument, grouped, option
from .printing import Output, outline, progress

SIMULATED = "The scans are simulated without people, and without furniture that is not on the map."


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
    picture: Path | None = option(None, "Draw the result on the map as .png.", "FILE"),
) -> None:
    """Simulate scans on a grid of poses and report where localization succeeds."""
    target = read_map_or_id(on)
    names = flags_of(scanner, "/laser") | flags_of(places) | {"/map": on}
    body = {"map": target, "laser": asdict(scanner), **asdict(places), "point": places.point and list(places.point)}
    body["landmark"] = [] if places.landmark is None else read_map_file(places.landmark).get("segments", [])
    with progress() as show:
        here = {"progress": partial(show, "places")} if where.server is None else {}
        answer = where.ask("analyze", body, names=names, **here)
    if picture is not None:
        with needing("drawing"):
            from formats import VERDICTS, PlaceMark, rgb, verdict_of

        marks = []
        for one in answer["places"]:
            colour = rgb(VERDICTS[verdict_of(one["status"], usable=one["usable"])])
            marks.append(PlaceMark(one["pose"]["x"], one["pose"]["y"], answer["spacing"], colour))
        draw_picture(where.whole_map(target), picture, marks=marks)
    told = {"spacing": answer["spacing"], **answer["summary"], "complete": answer["complete"]}
    output.print(answer, [*outline(told), SIMULATED])
