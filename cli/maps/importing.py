"""``linefix map import``: the map of another tool to a map file."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated

from ..asking import Where, answering
from ..errors import flags_of, needing
from ..inputs import draw_picture, existing
from ..logs import some_scans
from ..options import DRAW_RESULT, ORIENTED, WRITE_MAP, TopicOptions, argument, flag, grouped, option
from ..printing import Json, Output, noted, rows, write_json
from .checking import SAMPLES, check_rows, of_sensor

UNIT = "Unit of a drawing: m, cm, mm, dm, km, in, ft, yd, us-ft, or metres per unit."


@dataclass(frozen=True, slots=True)
class SaidOfFile:
    """Facts that a file does not state itself, as options; each is a field of the form of ``/v1/maps:import``."""

    units: str | None = option(None, UNIT, "UNIT")
    layers: list[str] | None = option(None, "Layers of a drawing to read, such as *WALL*; repeatable.", "PATTERN")
    where: list[str] | None = option(None, "Entities to read, such as indoor=wall; repeatable.", "PROPERTY=VALUE")
    level: str | None = option(None, "Floor of a drawing that has several levels.", "NAME")
    surface: float | None = option(None, "Depth of walls' surfaces behind the front of a grid's cells.", "CELLS")
    point: tuple[float, float] | None = option(None, "A free place, to find the walls' directions.", "X Y")
    drawn: str | None = option(None, "Which lines a drawing has: faces or centres of walls.", "WHAT")
    thickness: float | None = option(None, "Thickness of walls drawn by centre lines.", "METRES")
    oriented: bool | None = flag(*ORIENTED, default=None)
    local_metres: bool = flag("The coordinates of a GeoJSON are metres.", "--local-metres")
    topic: str | None = option(None, "Topic of the grid in a bag.", "TOPIC")
    unknown: str | None = option(None, "Grey value of unknown cells in a picture, 0 to 255, or none.", "GREY")

    @property
    def fields(self) -> Json:
        """The form: each field is a list of text."""
        said = {name: value for name, value in asdict(self).items() if value is not None}
        said |= {} if self.point is None else {"point": f"{self.point[0]} {self.point[1]}"}
        return {name: value if isinstance(value, list) else [str(value)] for name, value in said.items()}


@grouped
def import_map(
    file: Annotated[Path, argument("Map file: yaml of map_server, dxf, svg, geojson, csv, json, or a bag.", "FILE")],
    said: SaidOfFile,
    output: Output,
    out: Path | None = option(None, WRITE_MAP, "FILE"),
    picture: Path | None = option(None, DRAW_RESULT, "FILE"),
    log: Path | None = option(None, "A log of the building: find where the walls' surfaces are.", "FILE"),
) -> None:
    """Read a map of another tool, report what was read and what is doubtful, and write it as a map file."""
    answer = imported(file, said)
    if log is not None:
        answer = beside_log(answer, file, said, log)
    if picture is not None:
        draw_picture(answer["map"], picture)
    if out is not None:
        write_json(answer["map"], out)
    output.print(answer, rows([*report_rows(answer), *check_rows(answer["check"], answer["map"])]))


def imported(file: Path, said: SaidOfFile) -> Json:
    """Return what ``/v1/maps:import`` answers to a file; raises `WrongUseError` when there is no such file."""
    names = flags_of(said) | {"": existing(file).name}
    with answering(names) as service, needing(f"reading {file.name}"):
        from formats import read_map
        from linefix.operations import Stopwatch
        from service.importing.fields import options_of

        watch = Stopwatch()
        return service.check_import(read_map(file, options_of(said.fields)), watch)


def beside_log(answer: Json, file: Path, said: SaidOfFile, log: Path) -> Json:
    """Check an imported map with some scans of a log; import it again where walls lie elsewhere than assumed.

    Returns
    -------
    dict
        As of `imported`; ``check`` has the scans too.
    """
    scans = {"scans": [of_sensor(one) for one in some_scans(log, SAMPLES, TopicOptions())]}
    found = Where().ask("check_map", answer["map"], scans)
    thicker, meta, oriented = found["samples"]["wall_thickness"], answer["map"]["meta"], answer["map"]["oriented"]
    made_of_centres = "thickness" in meta or not oriented
    if thicker is not None and "surface" in meta and said.surface is None:
        cells = max(0.0, float(meta["surface"]) - 0.5 * thicker / float(meta["resolution"]))
        changed, replaced = replace(said, surface=round(cells, 2)), "surface"
        message = f"wall surfaces lie {cells:.2f} cells behind the border of the free cells"
    elif thicker is not None and made_of_centres and said.thickness is None and said.drawn != "faces":
        thickness = max(0.0, (float(meta.get("thickness", 0.0)) if oriented else 0.0) + thicker)
        changed, replaced = replace(said, drawn="centres", thickness=round(thickness, 2)), "thickness_given"
        message = f"walls are {thickness:.2f} m thick"
    else:
        return {**answer, "check": found}
    again = imported(file, changed)
    kept = [note for note in again["report"]["assumed"] if note["code"] != replaced]
    message += f", estimated from scans of {log.name}"
    note = {"code": f"{replaced.partition('_')[0]}_found", "message": message, "count": 0}
    again["report"]["assumed"] = [*kept, note]
    return {**again, "check": Where().ask("check_map", again["map"], scans)}


def report_rows(answer: Json) -> list[tuple[str, str]]:
    """Return the report of an import as text for people."""
    report, line_map = answer["report"], answer["map"]
    directed = "free space on the left" if line_map["oriented"] else "directions mean nothing"
    points = f", {len(line_map['points'])} points" if line_map.get("points") else ""
    found = [
        ("from", f"{', '.join(report['files'])} ({report['format']})"),
        ("map", f"{len(line_map['segments'])} segments, {directed}{points}"),
    ]
    for kind in ("read", "merged", "dropped", "assumed"):
        found += [(kind, noted(note)) for note in report[kind]]
    return found
