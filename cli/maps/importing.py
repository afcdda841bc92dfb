"""``linefix map import``: the map of another tool to a map file."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from .. import asking
from ..errors import Asked, WrongUseError
from ..inputs import line_map_of, needing_formats
from ..options import AsJson, Picture, Server, grouped
from ..printing import Json, noted, print_json, print_rows
from .checking import check_rows, samples_of
from .drawing import write_document
from .updating import draw_changes, update_by_drive, update_rows

if TYPE_CHECKING:
    from formats import ImportOptions

IMAGE = re.compile(r"^image:\s*[\"']?(?:.*[/\\])?([^/\\\"'#]+?)[\"']?\s*(?:#.*)?$", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class SaidOfFile:
    """Facts that a file does not state itself, as options."""

    units: Annotated[
        str | None,
        typer.Option(
            help="Unit of a drawing: m, cm, mm, dm, km, in, ft, yd, us-ft, or metres per unit.", metavar="UNIT"
        ),
    ] = None
    layers: Annotated[
        list[str] | None,
        typer.Option(metavar="PATTERN", help="Layers of a drawing to read, such as *WALL*; repeat for more patterns."),
    ] = None
    where: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PROPERTY=VALUE",
            help="Entities of a drawing to read, by a property, such as indoor=wall; repeat for more.",
        ),
    ] = None
    level: Annotated[str | None, typer.Option(metavar="NAME", help="Floor of a drawing that has several levels.")] = (
        None
    )
    surface: Annotated[
        float | None,
        typer.Option(
            metavar="CELLS",
            help="Distance of wall surfaces behind the front of the occupied cells of a grid. Default: detected.",
        ),
    ] = None
    point: Annotated[
        tuple[float, float] | None,
        typer.Option(
            metavar="X Y", help="A free place in metres; the directions of the walls around it are derived from it."
        ),
    ] = None
    drawn: Annotated[
        str | None,
        typer.Option(
            metavar="WHAT", help="Meaning of the lines of a drawing: faces or centres of walls. Default: detected."
        ),
    ] = None
    thickness: Annotated[
        float | None, typer.Option(metavar="METRES", help="Thickness of walls that are drawn by centre lines.")
    ] = None
    directions: Annotated[
        str | None,
        typer.Option(
            metavar="WHAT", help="drawn: free space lies on the left of each line; none: directions have no meaning."
        ),
    ] = None
    local_metres: Annotated[bool, typer.Option("--local-metres", help="The coordinates of a GeoJSON are metres.")] = (
        False
    )
    topic: Annotated[str | None, typer.Option(help="Topic of the grid in a bag.")] = None
    unknown: Annotated[
        str | None,
        typer.Option(
            metavar="GREY", help="Grey value of unknown cells in a picture, 0 to 255, or none. Default: detected."
        ),
    ] = None

    @property
    def options(self) -> ImportOptions:
        """The same for `formats`; raises `InputError` where a value is out of its range."""
        from formats import ImportOptions

        unknown: Any = int(self.unknown) if self.unknown and self.unknown.isdecimal() else self.unknown
        layers = tuple(name.strip() for one in self.layers or () for name in one.split(",") if name.strip())
        drawn, directions = cast("Any", self.drawn), cast("Any", self.directions)
        inside = (self.point,) if self.point else ()
        return ImportOptions(
            _units(self.units),
            layers,
            drawn,
            self.thickness,
            inside,
            directions,
            self.local_metres,
            self.topic,
            unknown,
            tuple(self.where or ()),
            self.level,
            self.surface,
        )

    @property
    def fields(self) -> Json:
        """The same as fields of a form."""
        once = {
            "units": self.units,
            "drawn": self.drawn,
            "thickness": self.thickness,
            "directions": self.directions,
            "local_metres": "true" if self.local_metres else None,
            "topic": self.topic,
            "unknown": self.unknown,
            "level": self.level,
            "surface": self.surface,
        }
        found: dict[str, list[str]] = {name: [str(value)] for name, value in once.items() if value is not None}
        found |= {name: values for name, values in (("layers", self.layers), ("where", self.where)) if values}
        found |= {"point": [f"{self.point[0]} {self.point[1]}"]} if self.point else {}
        return found


@grouped
def import_map(
    file: Annotated[
        Path,
        typer.Argument(
            help="Map file: yaml of map_server, dxf, svg, geojson, csv, json, or a bag with an OccupancyGrid."
        ),
    ],
    said: SaidOfFile,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the map to this file: json, dxf, svg, geojson or csv.")
    ] = None,
    picture: Picture = None,
    log: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="A log of the building: find the thickness of walls drawn by centre lines, or the surface of a grid.",
        ),
    ] = None,
    update: Annotated[
        bool, typer.Option("--update", help="Improve the map with the scans of --log; see map update.")
    ] = False,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Read a map of another tool, report what was read and what is doubtful, and write it as a map file."""
    if log is not None and server is not None:
        raise WrongUseError(
            "--log: not possible with --server; omit --server, and store the map with linefix map put afterwards"
        )
    if update and log is None:
        raise WrongUseError("--update: found no log, expected one; add --log FILE with scans of the building")
    answer = imported(file, said, server)
    if log is not None:
        answer = beside_log(answer, file, said, log)
    rows = [*report_rows(answer), *check_rows(answer["check"])]
    if update and log is not None:
        updated = update_by_drive(answer["map"], log)
        rows += update_rows(updated)
        if picture is not None:
            draw_changes(answer["map"], updated, picture)
        answer = {**answer, "map": updated.pop("map"), "update": updated}
    elif picture is not None:
        with needing_formats("drawing a picture"):
            from formats import draw_map

            draw_map(line_map_of(answer["map"]), picture)
    if out is not None:
        write_document(answer["map"], out)
    if as_json:
        print_json(answer)
    else:
        print_rows(rows)


def imported(file: Path, said: SaidOfFile, server: str | None) -> Json:
    """Return what ``/v1/maps:import`` answers to a file.

    Raises
    ------
    WrongUseError
        When there is no such file.
    """
    if not file.exists():
        raise WrongUseError(f"{file}: there is no such file; check the path and the working folder")
    if server is not None:
        with asking.server_at(server) as remote:
            return remote.import_map(_with_what_it_names(file), said.fields)
    with needing_formats(f"reading {file.name}"), asking.answering(Asked(files=(file.name,))) as within:
        from formats import read_map
        from linefix.answering import check_import
        from linefix.operations import Stopwatch

        options, watch = said.options, Stopwatch()
        with needing_formats(f"reading {file.name}"):
            return check_import(read_map(file, options), watch, within)


def beside_log(answer: Json, file: Path, said: SaidOfFile, log: Path) -> Json:
    """Check an imported map with some scans of a log; import it again where walls lie elsewhere than assumed.

    Returns
    -------
    dict
        As of `imported`; ``check`` has the scans too.
    """
    scans = samples_of(log, None)
    checked = asking.check(answer["map"], scans, None)
    thicker, line_map = checked["samples"]["wall_thickness"], answer["map"]
    meta = line_map["meta"]
    made_of_centres = "thickness" in meta or not line_map["oriented"]
    if thicker is not None and "surface" in meta and said.surface is None:
        cells = max(0.0, float(meta["surface"]) - 0.5 * thicker / float(meta["resolution"]))
        changed, replaced = replace(said, surface=round(cells, 2)), "surface"
        message = f"wall surfaces lie {cells:.2f} cells behind the border of the free cells"
    elif thicker is not None and made_of_centres and said.thickness is None and said.drawn != "faces":
        thickness = max(0.0, (float(meta.get("thickness", 0.0)) if line_map["oriented"] else 0.0) + thicker)
        changed, replaced = replace(said, drawn="centres", thickness=round(thickness, 2)), "thickness_given"
        message = f"walls are {thickness:.2f} m thick"
    else:
        return {**answer, "check": checked}
    again = imported(file, changed, None)
    kept = [note for note in again["report"]["assumed"] if note["code"] != replaced]
    found = {"code": f"{replaced.partition('_')[0]}_found", "count": 0}
    again["report"]["assumed"] = [*kept, {**found, "message": f"{message}, estimated from scans of {log.name}"}]
    return {**again, "check": asking.check(again["map"], scans, None)}


def _with_what_it_names(file: Path) -> list[Path]:
    """Return the files to send: a bag's folder whole, and in addition to a yaml its picture."""
    if file.is_dir():
        return sorted(path for path in file.iterdir() if path.is_file())
    if file.suffix.lower() not in (".yaml", ".yml"):
        return [file]
    named = IMAGE.search(file.read_text(encoding="utf-8-sig", errors="replace"))
    picture = file.with_name(named[1]) if named else file
    return [file, picture] if named and picture.is_file() else [file]


def _units(text: str | None) -> str | float | None:
    """Return metres per unit where the text is a number, else the name of a unit."""
    try:
        return None if text is None else float(text)
    except ValueError:
        return text


def report_rows(answer: Json) -> list[tuple[str, str]]:
    """Return the report of an import as text for people."""
    report, line_map = answer["report"], answer["map"]
    directed = "free space on the left" if line_map["oriented"] else "directions mean nothing"
    points = f", {len(line_map['points'])} points" if line_map.get("points") else ""
    rows = [
        ("from", f"{', '.join(report['files'])} ({report['format']})"),
        ("map", f"{len(line_map['segments'])} segments, {directed}{points}"),
    ]
    for kind in ("read", "merged", "dropped", "assumed"):
        rows += [(kind, noted(note)) for note in report[kind]]
    return rows
