"""``linefix locate``, ``explain``, ``register`` and ``vectorize``: commands on one scan."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

from .asking import Where
from .errors import WrongUseError, flags_of
from .inputs import NamedMap, places_of, read_json, read_map_file, read_maps, read_scan, target_of
from .options import ORIENTED, MapArgument, MapsArgument, ScanArgument, UsableOptions, argument, flag, grouped, option
from .printing import Json, Output, listing, outline, rows, verdict_rows, write_json


@dataclass(frozen=True, slots=True)
class SearchOptions:
    """The options of a search: the part of the map and the time."""

    near: tuple[float, float, float] | None = option(None, "Search only near this pose.", "X Y THETA")
    radius: float = option(1.0, "Maximum distance from --near.", "METRES")
    angle: float = option(0.5, "Maximum rotation from --near.", "RADIANS")
    oriented: bool = flag(*ORIENTED, default=True)
    deadline_ms: float | None = option(None, "Time limit of the search.", "MS")


@grouped
def locate(
    on: MapsArgument, scan: ScanArgument, search: SearchOptions, usable: UsableOptions, where: Where, output: Output
) -> None:
    """Find the pose of a scan on a map, or on one of several; the answer is that of /v1/associate."""
    answer = _asked(where, "associate", read_maps(on), scan, search, usable)
    output.print(answer, _located(answer))


def _located(answer: Json) -> Iterator[str]:
    found = verdict_rows(answer)
    if "maps" in answer and answer.get("map"):
        found.insert(1, ("map", answer["map"]["map_id"]))
    yield from rows(found)
    if answer.get("maps"):
        yield from listing(answer["maps"])


def _asked(
    where: Where, method: str, maps: Sequence[NamedMap], scan: str, search: SearchOptions, usable: UsableOptions
) -> Json:
    """Return the answer to the request of ``/v1/associate`` for the arguments and options of a command."""
    options = {"oriented": None if search.oriented else False, "deadline_ms": search.deadline_ms}
    body: Json = {**target_of(maps), "scan": read_scan(scan), "options": {**asdict(usable), **options}}
    if search.near is not None:
        if len(maps) > 1:
            raise WrongUseError("--near: found several maps, expected one; name the map of the pose alone")
        pose = dict(zip(("x", "y", "theta"), search.near, strict=True))
        body["prior"] = pose | {"radius": search.radius, "angle": search.angle}
    flags = flags_of(search, "/options") | flags_of(search, "/prior") | {"/prior": "--near"}
    return where.ask(method, body, names={**flags, **places_of(maps), "/scan": scan})


@grouped
def explain(on: MapArgument, scan: ScanArgument, search: SearchOptions, usable: UsableOptions, output: Output) -> None:
    """Show how the verdict on a scan came about: features, alternatives, null score, vetoes, probabilities.

    The answer is that of linefix locate. It is usable if its probability reaches --usable-from and no veto applies.
    """
    maps = read_maps([on])
    if len(maps) > 1:
        raise WrongUseError(f"{on}: found a folder with {len(maps)} maps, expected one map")
    found = _asked(Where(), "explain", maps, scan, search, usable)
    output.print(found, _explained(found))


def _explained(found: Json) -> Iterator[str]:
    yield from rows(verdict_rows(found["answer"]))
    for title, verdict in (("verdict", found["verdict"]), ("verdict of the last view alone", found["last_view"])):
        if verdict is not None:
            yield from ("", title)
            # Features are shown among the contributions, reasons with the answer.
            yield from outline({name: value for name, value in verdict.items() if name not in ("features", "reasons")})


@grouped
def register(
    on: Annotated[str, argument("A map file.", "MAP")],
    scan: ScanArgument,
    where: Where,
    output: Output,
    correspondences: str | None = option(None, "JSON file: [[scan index, map index], ...]. Default: i with i.", "FILE"),
) -> None:
    """Find the pose from known correspondences; the answer is that of /v1/register."""
    body = {"map": read_map_file(on), "scan": read_scan(scan)}
    if correspondences is not None:
        body["correspondences"] = read_json(correspondences)
    names = {"/map": on, "/scan": scan, "/correspondences": correspondences or "--correspondences"}
    answer = where.ask("register", body, names=names)
    output.print(answer, [*rows(verdict_rows(answer)), *outline(answer["diagnostics"])])


@grouped
def vectorize(
    scan: ScanArgument,
    where: Where,
    output: Output,
    out: Path | None = option(None, "Write the segments to this file, as a scan for locate.", "FILE"),
    sigma: float | None = option(None, "Standard deviation of the ranges. Default: estimated.", "METRES"),
) -> None:
    """Cut ranges or points into segments; the answer is that of /v1/vectorize."""
    told = read_scan(scan)
    # Frame and stamp of the scan make no difference here.
    asked: Json = {name: told[name] for name in ("laser", "points", "viewpoint") if name in told}
    asked["options"] = {"sigma": told.get("sigma") if sigma is None else sigma}
    answer = where.ask("vectorize", asked, names={"": scan})
    if out is not None:
        kept = {name: told[name] for name in ("frame_id", "stamp", "viewpoint") if name in told}
        found = {name: answer[name] for name in ("segments", "point_counts", "centroids", "spreads")}
        write_json({**kept, **found, "sigma": answer["sigmas"]}, out)
    told = {"segments": len(answer["segments"]), "sigma": answer["sigma"], "warnings": answer["warnings"]}
    output.print(answer, outline(told))
