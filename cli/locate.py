"""``linefix locate``: where in a map a scan was taken."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Annotated

import typer

from .asking import ask
from .errors import WrongUseError
from .options import AsJson, MapsArgument, ScanArgument, Server, UsableOptions, grouped
from .printing import Json, pose_text, print_json, print_rows, print_table, verdict_rows
from .scans import read_scan
from .several import read_target


@dataclass(frozen=True, slots=True)
class NearOptions:
    """A window around a pose that must contain the answer, as options."""

    near: Annotated[
        tuple[float, float, float] | None,
        typer.Option(metavar="X Y THETA", help="Search only near this pose; metres and radians."),
    ] = None
    radius: Annotated[float, typer.Option(metavar="METRES", help="Maximum distance from --near.")] = 1.0
    angle: Annotated[float, typer.Option(metavar="RADIANS", help="Maximum rotation from --near.")] = 0.5
    near_map: Annotated[str | None, typer.Option(metavar="MAP_ID", help="Of several maps the one of --near.")] = None


@dataclass(frozen=True, slots=True)
class SearchChoice:
    """How to search, as options."""

    undirected: Annotated[bool, typer.Option("--undirected", help="The directions of segments have no meaning.")] = (
        False
    )
    weight: Annotated[
        list[str] | None,
        typer.Option(
            metavar="MAP_ID=PROBABILITY",
            help="Probability of one of several maps, for example of a lift's display; may be repeated.",
        ),
    ] = None
    deadline_ms: Annotated[float | None, typer.Option(metavar="MS", help="Time limit of the search.")] = None


@grouped
def locate(
    on: MapsArgument,
    scan: ScanArgument,
    window: NearOptions,
    search: SearchChoice,
    usable: UsableOptions,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Find the pose of a scan on a map, or on one of several; the answer is that of /v1/associate."""
    answer = ask("associate", request_body(on, scan, window, search, usable), server)
    if as_json:
        print_json(answer)
        return
    rows = verdict_rows(answer)
    if "maps" in answer and answer.get("map"):
        rows.insert(1, ("map", answer["map"]["map_id"]))
    print_rows(rows)
    if answer.get("maps"):
        columns = ("map", "status", "score", "probability", "pose")
        print_table(columns, [_map_row(one) for one in answer["maps"]])


def request_body(
    on: Sequence[str], scan: str, window: NearOptions, search: SearchChoice, usable: UsableOptions
) -> Json:
    """Return the request of ``/v1/associate`` for the arguments and options of a command."""
    body: Json = {**read_target(on), "scan": read_scan(scan), "options": asdict(usable)}
    if window.near is not None:
        pose = dict(zip(("x", "y", "theta"), window.near, strict=True))
        body["prior"] = pose | {"radius": window.radius, "angle": window.angle}
        if window.near_map is not None:
            body["prior"]["map_id"] = window.near_map
    elif window.near_map is not None:
        raise WrongUseError("--near-map: found no --near, expected the pose on that map; add --near X Y THETA")
    if search.weight:
        body["map_weights"] = dict(map(_weight, search.weight))
    if search.undirected:
        body["options"]["oriented"] = False
    if search.deadline_ms is not None:
        body["options"]["deadline_ms"] = search.deadline_ms
    return body


def _map_row(one: Json) -> tuple[object, ...]:
    pose = None if one["pose"] is None else pose_text(one["pose"])
    return one["map_id"], one["status"], one["score"], one["probability"], pose


def _weight(told: str) -> tuple[str, float]:
    """Return the map and its probability of ``MAP_ID=PROBABILITY``; raises `WrongUseError` where it is not that."""
    name, _, value = told.rpartition("=")
    try:
        return name, float(value)
    except ValueError:
        raise WrongUseError(f"--weight: found {told!r}, expected MAP_ID=PROBABILITY, for example hq-3=0.8") from None
