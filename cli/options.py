"""Options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Server = Annotated[
    str | None,
    typer.Option("--server", metavar="URL", help="Use the service at this URL; the key is read from LINEFIX_KEY."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print the complete answer as JSON.")]
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
        help="A scan file: JSON with segments, points, laser or views; a LaserScan "
        "message as JSON or as YAML; - reads stdin.",
    ),
]
Picture = Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the result to this PNG file.")]
