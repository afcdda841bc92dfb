"""Options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Server = Annotated[
    str | None,
    typer.Option("--server", metavar="URL", help="Ask the service there; a key is read from LINEFIX_KEY."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print the whole answer as JSON.")]
MapArgument = Annotated[
    str,
    typer.Argument(
        metavar="MAP",
        help="A map file: json, yaml of map_server, dxf, svg, geojson or csv; or the id of a stored map.",
    ),
]
ScanArgument = Annotated[
    str,
    typer.Argument(
        metavar="SCAN",
        help="A scan as JSON: segments, points or laser, or the fields of a LaserScan message; - reads it from stdin.",
    ),
]
Picture = Annotated[Path | None, typer.Option(metavar="FILE", help="Draw it there, as png.")]
