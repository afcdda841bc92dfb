"""``linefix map put``, ``list``, ``get``, ``rm``: maps stored by id."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..asking import keeping
from ..errors import WrongUseError
from ..inputs import MAP_ID, read_map_file
from ..options import AsJson, Server
from ..printing import print_json, print_rows, print_table
from .drawing import write_document

MapId = Annotated[str, typer.Argument(metavar="ID", help="Id of the map: 1 to 128 of A-Z a-z 0-9 . _ -")]


def put(
    map_id: MapId,
    file: Annotated[
        str, typer.Argument(metavar="FILE", help="A map file: json, or another file that map import reads.")
    ],
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
    rows = [
        (m["map_id"], m["revision"], m["segment_count"], *map(float, m["bounds"]), m["sigma"], m["oriented"])
        for m in found
    ]
    print_table(columns, rows)


def get(
    map_id: MapId,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Write the map to this file: json, dxf, svg, geojson or csv. Default: print it."
        ),
    ] = None,
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
