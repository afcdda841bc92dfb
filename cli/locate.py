"""``linefix locate``: where in a map a scan was taken."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import typer

from .asking import ask
from .contract import Json
from .inputs import read_map_or_id
from .options import AsJson, MapArgument, ScanArgument, Server, grouped
from .printing import print_json, print_rows, verdict_rows
from .scans import read_scan


@dataclass(frozen=True, slots=True)
class NearOptions:
    """A window around a pose that must contain the answer, as options."""

    near: Annotated[
        tuple[float, float, float] | None,
        typer.Option(metavar="X Y THETA", help="Search only near this pose; metres and radians."),
    ] = None
    radius: Annotated[float, typer.Option(metavar="METRES", help="Maximum distance from --near.")] = 1.0
    angle: Annotated[float, typer.Option(metavar="RADIANS", help="Maximum rotation from --near.")] = 0.5


@dataclass(frozen=True, slots=True)
class SearchChoice:
    """How to search, as options."""

    undirected: Annotated[bool, typer.Option("--undirected", help="The directions of segments have no meaning.")] = (
        False
    )
    causes: Annotated[
        bool,
        typer.Option(
            "--causes", help="If the answer is not usable, test the scan mirrored, reversed and in other units."
        ),
    ] = False
    deadline_ms: Annotated[float | None, typer.Option(metavar="MS", help="Time limit of the search.")] = None


@grouped
def locate(
    on: MapArgument,
    scan: ScanArgument,
    window: NearOptions,
    search: SearchChoice,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Find the pose of a scan on a map; the answer is that of /v1/associate."""
    answer = ask("associate", request_body(on, scan, window, search), server)
    if as_json:
        print_json(answer)
    else:
        print_rows(verdict_rows(answer))


def request_body(on: str, scan: str, window: NearOptions, search: SearchChoice) -> Json:
    """Return the request of ``/v1/associate`` for the arguments and options of a command."""
    body: Json = {"map": read_map_or_id(on), "scan": read_scan(scan), "options": {}}
    if window.near is not None:
        pose = dict(zip(("x", "y", "theta"), window.near, strict=True))
        body["prior"] = pose | {"radius": window.radius, "angle": window.angle}
    if search.undirected:
        body["options"]["oriented"] = False
    if search.causes:
        body["options"]["include"] = ["correspondences", "alternatives", "segments", "missing_map", "causes"]
    if search.deadline_ms is not None:
        body["options"]["deadline_ms"] = search.deadline_ms
    return body
