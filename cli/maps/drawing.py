"""``linefix map draw``: maps to pictures, and to the files of other tools."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..asking import document_at
from ..inputs import line_map_of, needing_formats
from ..options import MapArgument, Server
from ..printing import Json, write_json


def draw(
    on: MapArgument,
    out: Annotated[Path, typer.Option(metavar="FILE", help="File to write: png, svg, dxf, geojson, csv or json.")],
    server: Server = None,
) -> None:
    """Draw a map: walls in grey, a blue tick on the free side of each."""
    document = document_at(on, server)
    if out.suffix.lower() != ".png":
        write_document(document, out)
        return
    with needing_formats("drawing a picture"):
        from formats import draw_map

        draw_map(line_map_of(document), out)


def write_document(document: Json, out: Path) -> None:
    """Write a map in the format of the file's name.

    Raises
    ------
    RefusedError
        When it has another, or the extra ``[formats]`` is missing.
    """
    if out.suffix.lower() == ".json":
        write_json(document, out)
        return
    with needing_formats(f"writing {out.name}"):
        from formats import write_map

        write_map(line_map_of(document), out)
