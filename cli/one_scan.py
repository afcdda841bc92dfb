"""``linefix locate``, ``explain``, ``register`` and ``vectorize``: commands on one scan."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

from .asking import Where
from .errors import Names, WrongUseError, flags_of
from .inputs import NamedMap, places_of, read_map_file, read_maps, target_of
from .options import ORIENTED, MapArgument, MapsArgument, ScanArgument, UsableOptions, argument, flag, grouped, option
from .printing import Json, Output, pose_text, rows, section, table, verdict_rows, write_json
from .scans import read_json, read_scan

MOST_ALTERNATIVES = 10  # that people read; --json has all
TAKEN = ("laser", "points", "viewpoint")  # of a scan for vectorize; its frame and stamp make no difference there
OF_MAPS: Names = {"/prior": "--near", "/prior/map_id": "--near-map", "/map_weights": "--weight"}


@dataclass(frozen=True, slots=True)
class SearchOptions:
    """The options of a search: the part of the map and the time."""

    near: tuple[float, float, float] | None = option(None, "Search only near this pose.", "X Y THETA")
    radius: float = option(1.0, "Maximum distance from --near.", "METRES")
    angle: float = option(0.5, "Maximum rotation from --near.", "RADIANS")
    oriented: bool = flag(*ORIENTED, default=True)
    deadline_ms: float | None = option(None, "Time limit of the search.", "MS")


@dataclass(frozen=True, slots=True)
class SeveralOptions:
    """Prior knowledge about several maps, as options."""

    near_map: str | None = option(None, "Of several maps the one of --near.", "MAP_ID")
    weight: list[str] | None = option(None, "Probability of one of several maps; repeatable.", "MAP_ID=PROBABILITY")


@grouped
def locate(
    on: MapsArgument,
    scan: ScanArgument,
    search: SearchOptions,
    several: SeveralOptions,
    usable: UsableOptions,
    where: Where,
    output: Output,
) -> None:
    """Find the pose of a scan on a map, or on one of several; the answer is that of /v1/associate."""
    maps = read_maps(on)
    body = _request(maps, scan, search, usable)
    if several.near_map is not None:
        if search.near is None:
            raise WrongUseError("--near-map: found no --near, expected the pose on that map; add --near X Y THETA")
        body["prior"]["map_id"] = several.near_map
    if several.weight:
        body["map_weights"] = dict(map(_weight, several.weight))
    answer = where.ask("associate", body, names=_names(maps, scan, search))
    output.print(answer, _located(answer))


def _located(answer: Json) -> Iterator[str]:
    found = verdict_rows(answer)
    if "maps" in answer and answer.get("map"):
        found.insert(1, ("map", answer["map"]["map_id"]))
    yield from rows(found)
    if answer.get("maps"):
        columns = ("map_id", "status", "score", "probability")
        maps = [(*(one[name] for name in columns), one["pose"] and pose_text(one["pose"])) for one in answer["maps"]]
        yield from table(("map", *columns[1:], "pose"), maps)


def _request(maps: Sequence[NamedMap], scan: str, search: SearchOptions, usable: UsableOptions) -> Json:
    """Return the request of ``/v1/associate`` for the arguments and options of a command."""
    options = {"oriented": None if search.oriented else False, "deadline_ms": search.deadline_ms}
    body: Json = {**target_of(maps), "scan": read_scan(scan), "options": {**asdict(usable), **options}}
    if search.near is not None:
        pose = dict(zip(("x", "y", "theta"), search.near, strict=True))
        body["prior"] = pose | {"radius": search.radius, "angle": search.angle}
    return body


def _names(maps: Sequence[NamedMap], scan: str, search: SearchOptions) -> Names:
    """Return the user's names for places in such a request."""
    flags = flags_of(search, "/options") | flags_of(search, "/prior")
    return {**flags, **OF_MAPS, **places_of(maps), "/scan": scan}


def _weight(told: str) -> tuple[str, float]:
    """Return the map and its probability of ``MAP_ID=PROBABILITY``; raises `WrongUseError` where it is not that."""
    name, _, value = told.rpartition("=")
    try:
        return name, float(value)
    except ValueError:
        raise WrongUseError(f"--weight: found {told!r}, expected MAP_ID=PROBABILITY, for example hq-3=0.8") from None


@grouped
def explain(on: MapArgument, scan: ScanArgument, search: SearchOptions, usable: UsableOptions, output: Output) -> None:
    """Show how the verdict on a scan came about: features, alternatives, null score, vetoes, probabilities.

    The answer is that of linefix locate. It is usable if its probability reaches --usable-from and no veto applies.
    """
    maps = read_maps([on])
    if len(maps) > 1:
        raise WrongUseError(f"{on}: found a folder with {len(maps)} maps, expected one map")
    found = Where().ask("explain", _request(maps, scan, search, usable), names=_names(maps, scan, search))
    output.print(found, _explained(found))


def _explained(found: Json) -> Iterator[str]:
    yield from rows(verdict_rows(found["answer"]))
    yield from _verdict(found["verdict"])
    if found["last_view"] is not None:
        yield from ("", "The last view of the drive alone:", *_verdict(found["last_view"]))


def _verdict(one: Json) -> Iterator[str]:
    """Return a verdict, part by part."""
    if one["features"] is not None:
        yield from _features(one)
    vetoes = [(veto["name"], veto["reason"], "applies" if veto["applies"] else "passed") for veto in one["vetoes"]]
    yield from section("Vetoes", ("veto", "reason", "result"), vetoes)
    if one["features"] is not None:
        least = one["thresholds"]
        title = f"Probabilities, with the prior probability {least['on_map']:.2f} of the map"
        probabilities = [
            ("by the model", one["by_model"], None),
            ("among the alternatives", one["among"], None),
            ("of the pose, their product", one["by_model"] * one["among"], least["usable_from"]),
            ("explained", one["explained"], least["explained"]),
        ]
        yield from section(title, ("probability", "value", "threshold"), probabilities)
    yield from ("", f"status {one['status']}, {'usable' if one['usable'] else 'not usable'}")


def _features(one: Json) -> Iterator[str]:
    """Return the terms of the odds against each way of being not right, next to those of a usual right answer."""
    for against, odds in one["log_odds"].items():
        terms = [term for term in one["contributions"] if term["against"] == against]
        found = [(term["name"], term["value"], term["nats"], term["usual"]) for term in terms]
        title = f"Contributions to the log odds against {against}, nats"
        yield from section(title, ("feature", "value", "contribution", "usual"), found)
        yield f"log odds with the constant: {odds:.3f}"
    title = "Increase of the log odds if the features of a reason were usual, nats"
    yield from section(title, ("reason", "nats"), one["taken"].items())
    others, null = one["alternatives"], one["null"]
    yield from ("", f"Alternatives: {len(others)}; the answer has weight 1")
    if others:
        first = others[:MOST_ALTERNATIVES]
        gaps = [(pose_text(other["pose"]), round(other["gap"], 3) + 0.0, other["weight"]) for other in first]
        yield from table(("pose", "gap in nats", "weight"), gaps)
    told = "the mirrored scan fits nowhere"
    if null is None:
        told = "not searched, because the answer is not usable without it"
    elif null["score"]:
        told = f"{null['score']:.1f} nats, {null['fraction']:.3f} of the answer's score"
    yield from ("", f"Null score: {told}")


@grouped
def register(
    on: Annotated[str, argument("A map file.", "MAP")],
    scan: ScanArgument,
    where: Where,
    output: Output,
    correspondences: str | None = option(None, "JSON file: [[scan index, map index], ...]. Default: i with i.", "FILE"),
    oriented: bool = flag(*ORIENTED, default=True),
) -> None:
    """Find the pose from known correspondences; the answer is that of /v1/register."""
    body = {"map": read_map_file(on), "scan": read_scan(scan), "options": {"oriented": None if oriented else False}}
    if correspondences is not None:
        body["correspondences"] = read_json(correspondences)
    names = {"/map": on, "/scan": scan, "/correspondences": correspondences or "--correspondences"}
    answer = where.ask("register", body, names=names)
    found = answer["diagnostics"]
    chi2 = "none" if found["chi2"] is None else f"{found['chi2']:.2f}"
    fit = f"{found['pairs']} pairs, chi2 {chi2} at {found['dof']} degrees of freedom"
    output.print(answer, rows([*verdict_rows(answer), ("fit", fit)]))


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
    asked: Json = {name: told[name] for name in TAKEN if name in told}
    asked["options"] = {"sigma": told.get("sigma") if sigma is None else sigma}
    answer = where.ask("vectorize", asked, names={"": scan})
    if out is not None:
        kept: Json = {name: told[name] for name in ("frame_id", "stamp", "viewpoint") if name in told}
        kept |= {name: answer[name] for name in ("segments", "point_counts", "centroids", "spreads")}
        write_json({**kept, "sigma": answer["sigmas"]}, out)
    output.print(answer, _segments(answer))


def _segments(answer: Json) -> Iterator[str]:
    found = [
        (number, *segment, math.hypot(segment[2] - segment[0], segment[3] - segment[1]), points)
        for number, (segment, points) in enumerate(zip(answer["segments"], answer["point_counts"], strict=True))
    ]
    yield from table(("", "x1", "y1", "x2", "y2", "length", "points"), found)
    warnings = [("warning", f"{one['code']}: {one['message']}") for one in answer["warnings"]]
    yield from rows([("sigma", f"{answer['sigma']:.4f} m"), *warnings])
