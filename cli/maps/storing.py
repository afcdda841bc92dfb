"""``linefix map put``, ``list``, ``get``, ``rm``: maps stored by id; and ``draw``: maps to files of other tools."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from ..asking import Where
from ..errors import WrongUseError
from ..inputs import MAP_ID, draw_picture, read_map_file, read_map_or_id, write_document
from ..options import WRITE_MAP, MapArgument, argument, grouped, option, required
from ..printing import Json, Output, print_json, print_lines, rows, table

COLUMNS = ("id", "revision", "segments", "from x", "y", "to x", "y", "sigma", "oriented")


def _checked(map_id: str) -> str:
    if not MAP_ID.fullmatch(map_id):
        raise WrongUseError(f"the id is not valid: expected 1 to 128 of A-Z a-z 0-9 . _ -, found {map_id[:200]!r}")
    return map_id


MapId = Annotated[str, argument("Id of the map: 1 to 128 of A-Z a-z 0-9 . _ -", "ID")]
MapFile = Annotated[str, argument("A map file: json, or another file that map import reads.", "FILE")]


@grouped
def put(map_id: MapId, file: MapFile, where: Where, output: Output) -> None:
    """Store a map under an id."""
    told = where.ask("put_map", _checked(map_id), read_map_file(file), names={"": file})
    line = f"{told['map_id']}, revision {told['revision']}, {told['segment_count']} segments"
    output.print(told, rows([("stored", line)]))


@grouped
def list_maps(where: Where, output: Output) -> None:
    """List the stored maps, by id; with --json one a line."""
    found, cursor = list[Json](), None
    with where.opened() as service:
        while not found or cursor is not None:
            page = service.ask("list_maps", cursor=cursor)
            found, cursor = [*found, page], page["next"]
    maps = [one for page in found for one in page["maps"]]
    if output.as_json:
        for one in maps:
            print_json(one)
        return
    names = ("map_id", "revision", "segment_count")
    records = [(*(m[name] for name in names), *map(float, m["bounds"]), m["sigma"], m["oriented"]) for m in maps]
    print_lines(table(COLUMNS, records))


@grouped
def get(
    map_id: MapId,
    where: Where,
    out: Path | None = option(None, f"{WRITE_MAP} Default: print it.", "FILE"),
) -> None:
    """Print a stored map as JSON, or write it to a file."""
    document = where.ask("get_map", _checked(map_id))
    if out is None:
        print_json(document)
    else:
        write_document(document, out)


@grouped
def remove(map_id: MapId, where: Where) -> None:
    """Forget a stored map."""
    where.ask("delete_map", _checked(map_id))


@grouped
def draw(
    on: MapArgument,
    out: Annotated[Path, required("File to write: png, svg, dxf, geojson, csv or json.", "FILE")],
    where: Where,
) -> None:
    """Draw a map: walls in grey, a blue tick on the free side of each."""
    write = draw_picture if out.suffix.lower() == ".png" else write_document
    write(where.whole_map(read_map_or_id(on)), out)
