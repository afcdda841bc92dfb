"""``linefix locate``: where in a map a scan was taken."""

from __future__ import annotations

from typing import Annotated

import typer

from .asking import ask
from .contract import Json
from .inputs import read_map_or_id, read_scan
from .options import AsJson, MapArgument, ScanArgument, Server
from .printing import print_json, print_rows, verdict_rows


def locate(
    on: MapArgument,
    scan: ScanArgument,
    near: Annotated[
        tuple[float, float, float] | None,
        typer.Option(metavar="X Y THETA", help="Look only near this pose; metres, radians."),
    ] = None,
    radius: Annotated[float, typer.Option(metavar="METRES", help="How far from --near.")] = 1.0,
    angle: Annotated[float, typer.Option(metavar="RADIANS", help="How far turned from --near.")] = 0.5,
    undirected: Annotated[bool, typer.Option("--undirected", help="Directions of segments mean nothing.")] = False,
    causes: Annotated[
        bool, typer.Option("--causes", help="Where nothing fits, look whether the scan is mirrored, or the like.")
    ] = False,
    deadline_ms: Annotated[float | None, typer.Option(metavar="MS", help="Time for the search.")] = None,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Find where in a map a scan was taken; the answer is that of /v1/associate."""
    body: Json = {"map": read_map_or_id(on), "scan": read_scan(scan), "options": {}}
    if near is not None:
        body["prior"] = dict(zip(("x", "y", "theta"), near, strict=True), radius=radius, angle=angle)
    if undirected:
        body["options"]["oriented"] = False
    if causes:
        body["options"]["include"] = ["correspondences", "alternatives", "segments", "missing_map", "causes"]
    if deadline_ms is not None:
        body["options"]["deadline_ms"] = deadline_ms
    answer = ask("associate", body, server)
    if as_json:
        print_json(answer)
    else:
        print_rows(verdict_rows(answer))
