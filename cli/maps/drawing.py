"""``linefix map draw``: a picture of a map."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..inputs import document_at, line_map_of, needing_formats
from ..options import MapArgument, Server
from .files import write_document


def draw(
    on: MapArgument,
    out: Annotated[Path, typer.Option(metavar="FILE", help="File to write: png, svg, dxf, geojson, csv or json.")],
    server: Server = None,
) -> None:
    """Draw a map: walls in black, a green tick on the free side of each."""
    document = document_at(on, server)
    if out.suffix.lower() != ".png":
        write_document(document, out)
        return
    with needing_formats("drawing a picture"):
        from formats import draw_map

        draw_map(line_map_of(document), out)
