"""``linefix map put``, ``list``, ``get``, ``rm``: maps stored by id; and ``draw``: maps to files of other tools."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from ..asking import keeping
from ..errors import WrongUseError
from ..inputs import MAP_ID, document_at, draw_picture, read_map_file, write_document
from ..options import WRITE_MAP, AsJson, File, MapArgument, Server, argument, option
from ..printing import print_json, print_rows, print_table

MapId = Annotated[str, argument("Id of the map: 1 to 128 of A-Z a-z 0-9 . _ -", "ID")]


def put(
    map_id: MapId,
    file: Annotated[str, argument("A map file: json, or another file that map import reads.", "FILE")],
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Store a map under an id."""
    document = read_map_file(file)
    with keeping(server) as maps:
        told = maps.put(_checked(map_id), document)
    if as_json:
        print_json(told)
    else:
        print_rows([("stored", f"{told['map_id']}, revision {told['revision']}, {told['segment_count']} segments")])


def list_maps(server: Server = None, as_json: AsJson = False) -> None:
    """List the stored maps, by id; with --json one a line."""
    with keeping(server) as maps:
        found = list(maps.maps())
    if as_json:
        for one in found:
            print_json(one)
        return
    columns = ("id", "revision", "segments", "from x", "y", "to x", "y", "sigma", "oriented")
    names = ("map_id", "revision", "segment_count")
    rows = [(*(m[name] for name in names), *map(float, m["bounds"]), m["sigma"], m["oriented"]) for m in found]
    print_table(columns, rows)


def get(
    map_id: MapId,
    out: Annotated[File, option(f"{WRITE_MAP} Default: print it.", "FILE")] = None,
    server: Server = None,
) -> None:
    """Print a stored map as JSON, or write it to a file."""
    with keeping(server) as maps:
        document = maps.get(_checked(map_id))
    if out is None:
        print_json(document)
    else:
        write_document(document, out)


def remove(map_id: MapId, server: Server = None) -> None:
    """Forget a stored map."""
    with keeping(server) as maps:
        maps.remove(_checked(map_id))


def _checked(map_id: str) -> str:
    if not MAP_ID.fullmatch(map_id):
        raise WrongUseError(f"the id is not valid: expected 1 to 128 of A-Z a-z 0-9 . _ -, found {map_id[:200]!r}")
    return map_id


def draw(
    on: MapArgument,
    out: Annotated[Path, option("File to write: png, svg, dxf, geojson, csv or json.", "FILE")],
    server: Server = None,
) -> None:
    """Draw a map: walls in grey, a blue tick on the free side of each."""
    write = draw_picture if out.suffix.lower() == ".png" else write_document
    write(document_at(on, server), out)
