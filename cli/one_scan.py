"""``linefix locate``, ``explain``, ``register`` and ``vectorize``: commands on one scan."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Annotated

from .asking import ask
from .errors import WrongUseError
from .inputs import read_map_file, read_target
from .options import (
    LIKELY,
    AsJson,
    File,
    MapArgument,
    MapsArgument,
    Number,
    ScanArgument,
    Server,
    Text,
    Texts,
    Undirected,
    UsableOptions,
    argument,
    grouped,
    option,
)
from .printing import Json, pose_text, print_json, print_rows, print_table, verdict_rows, write_json
from .scans import read_json, read_scan

MOST_ALTERNATIVES = 10  # that people read; --json has all
TAKEN = ("laser", "points", "viewpoint")  # of a scan for vectorize; its frame and stamp make no difference there


@dataclass(frozen=True, slots=True)
class NearOptions:
    """A window around a pose that must contain the answer, as options."""

    near: Annotated[tuple[float, float, float] | None, option("Search only near this pose.", "X Y THETA")] = None
    radius: Annotated[float, option("Maximum distance from --near.", "METRES")] = 1.0
    angle: Annotated[float, option("Maximum rotation from --near.", "RADIANS")] = 0.5


@dataclass(frozen=True, slots=True)
class SeveralOptions:
    """Prior knowledge about several maps, as options."""

    near_map: Annotated[Text, option("Of several maps the one of --near.", "MAP_ID")] = None
    weight: Annotated[Texts, option("Probability of one of several maps; repeatable.", f"MAP_ID={LIKELY}")] = None


@dataclass(frozen=True, slots=True)
class SearchChoice:
    """How to search, as options."""

    undirected: Undirected = False
    deadline_ms: Annotated[Number, option("Time limit of the search.", "MS")] = None


@grouped
def locate(
    on: MapsArgument,
    scan: ScanArgument,
    window: NearOptions,
    several: SeveralOptions,
    search: SearchChoice,
    usable: UsableOptions,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Find the pose of a scan on a map, or on one of several; the answer is that of /v1/associate."""
    answer = ask("associate", server, _request(on, scan, window, search, usable, several))
    if as_json:
        print_json(answer)
        return
    rows = verdict_rows(answer)
    if "maps" in answer and answer.get("map"):
        rows.insert(1, ("map", answer["map"]["map_id"]))
    print_rows(rows)
    if answer.get("maps"):
        columns = ("map_id", "status", "score", "probability")
        maps = [(*(one[name] for name in columns), one["pose"] and pose_text(one["pose"])) for one in answer["maps"]]
        print_table(("map", *columns[1:], "pose"), maps)


def _request(
    on: Sequence[str],
    scan: str,
    window: NearOptions,
    search: SearchChoice,
    usable: UsableOptions,
    several: SeveralOptions | None = None,
) -> Json:
    """Return the request of ``/v1/associate`` for the arguments and options of a command."""
    several = several or SeveralOptions()
    body: Json = {**read_target(on), "scan": read_scan(scan), "options": asdict(usable)}
    if window.near is not None:
        pose = dict(zip(("x", "y", "theta"), window.near, strict=True))
        body["prior"] = pose | {"radius": window.radius, "angle": window.angle}
        if several.near_map is not None:
            body["prior"]["map_id"] = several.near_map
    elif several.near_map is not None:
        raise WrongUseError("--near-map: found no --near, expected the pose on that map; add --near X Y THETA")
    if several.weight:
        body["map_weights"] = dict(map(_weight, several.weight))
    if search.undirected:
        body["options"]["oriented"] = False
    if search.deadline_ms is not None:
        body["options"]["deadline_ms"] = search.deadline_ms
    return body


def _weight(told: str) -> tuple[str, float]:
    """Return the map and its probability of ``MAP_ID=PROBABILITY``; raises `WrongUseError` where it is not that."""
    name, _, value = told.rpartition("=")
    try:
        return name, float(value)
    except ValueError:
        raise WrongUseError(f"--weight: found {told!r}, expected MAP_ID=PROBABILITY, for example hq-3=0.8") from None


@grouped
def explain(
    on: MapArgument,
    scan: ScanArgument,
    window: NearOptions,
    search: SearchChoice,
    usable: UsableOptions,
    as_json: AsJson = False,
) -> None:
    """Show how the verdict on a scan came about: features, alternatives, null score, vetoes, probabilities.

    The answer is that of linefix locate. It is usable if its probability reaches --usable-from and no veto applies.
    """
    body = _request([on], scan, window, search, usable)
    if "maps" in body:
        raise WrongUseError(f"{on}: found a folder with {len(body['maps'])} maps, expected one map")
    found = ask("explain", None, body)
    if as_json:
        print_json(found)
        return
    print_rows(verdict_rows(found["answer"]))
    _print_verdict(found["verdict"])
    if found["last_view"] is not None:
        print("\nThe last view of the drive alone:")
        _print_verdict(found["last_view"])


def _print_verdict(one: Json) -> None:
    """Print a verdict, part by part."""
    known = one["features"] is not None
    if known:
        for against in one["log_odds"]:
            _print_odds(one, against)
        print("\nIncrease of the log odds if the features of a reason were usual, nats")
        print_table(("reason", "nats"), list(one["taken"].items()))
        _print_alternatives(one["alternatives"])
        print(f"\nNull score: {_null(one['null'])}")
    print("\nVetoes")
    vetoes = [(veto["name"], veto["reason"], "applies" if veto["applies"] else "passed") for veto in one["vetoes"]]
    print_table(("veto", "reason", "result"), vetoes)
    if known:
        _print_probabilities(one)
    print(f"\nstatus {one['status']}, {'usable' if one['usable'] else 'not usable'}")


def _print_odds(one: Json, against: str) -> None:
    """Print the terms of the odds against one way of being not right, next to those of a usual right answer."""
    print(f"\nContributions to the log odds against {against}, nats")
    terms = [term for term in one["contributions"] if term["against"] == against]
    rows = [(term["name"], term["value"], term["nats"], term["usual"]) for term in terms]
    print_table(("feature", "value", "contribution", "usual"), rows)
    print(f"log odds with the constant: {one['log_odds'][against]:.3f}")


def _print_alternatives(others: list[Json]) -> None:
    """Print the alternatives with their weights."""
    print(f"\nAlternatives: {len(others)}; the answer has weight 1")
    first = others[:MOST_ALTERNATIVES]
    rows = [(pose_text(other["pose"]), round(other["gap"], 3) + 0.0, other["weight"]) for other in first]
    if rows:
        print_table(("pose", "gap in nats", "weight"), rows)


def _null(null: Json | None) -> str:
    if null is None:
        return "not searched, because the answer is not usable without it"
    if not null["score"]:
        return "the mirrored scan fits nowhere"
    return f"{null['score']:.1f} nats, {null['fraction']:.3f} of the answer's score"


def _print_probabilities(one: Json) -> None:
    """Print the probabilities and their thresholds."""
    least = one["thresholds"]
    print(f"\nProbabilities, with the prior probability {least['on_map']:.2f} of the map")
    rows = [
        ("by the model", one["by_model"], None),
        ("among the alternatives", one["among"], None),
        ("of the pose, their product", one["by_model"] * one["among"], least["usable_from"]),
        ("explained", one["explained"], least["explained"]),
    ]
    print_table(("probability", "value", "threshold"), rows)


def register(
    on: Annotated[str, argument("A map file.", "MAP")],
    scan: ScanArgument,
    pairs: Annotated[Text, option("JSON file: [[scan index, map index], ...]. Default: i with i.", "FILE")] = None,
    undirected: Undirected = False,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Find the pose from known correspondences; the answer is that of /v1/register."""
    body: Json = {"map": read_map_file(on), "scan": read_scan(scan)}
    if pairs is not None:
        body["correspondences"] = read_json(pairs)
    if undirected:
        body["options"] = {"oriented": False}
    answer = ask("register", server, body)
    if as_json:
        print_json(answer)
        return
    found = answer["diagnostics"]
    chi2 = "none" if found["chi2"] is None else f"{found['chi2']:.2f}"
    fit = f"{found['pairs']} pairs, chi2 {chi2} at {found['dof']} degrees of freedom"
    print_rows([*verdict_rows(answer), ("fit", fit)])


def vectorize(
    scan: ScanArgument,
    out: Annotated[File, option("Write the segments to this file, as a scan for locate.", "FILE")] = None,
    sigma: Annotated[Number, option("Standard deviation of the ranges. Default: estimated.", "METRES")] = None,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Cut ranges or points into segments; the answer is that of /v1/vectorize."""
    told = read_scan(scan)
    asked: Json = {name: told[name] for name in TAKEN if name in told}
    sigma = told.get("sigma") if sigma is None else sigma
    if sigma is not None:
        asked["options"] = {"sigma": sigma}
    answer = ask("vectorize", server, asked)
    if out is not None:
        kept: Json = {name: told[name] for name in ("frame_id", "stamp", "viewpoint") if name in told}
        kept |= {name: answer[name] for name in ("segments", "point_counts", "centroids", "spreads")}
        write_json({**kept, "sigma": answer["sigmas"]}, out)
    if as_json:
        print_json(answer)
        return
    rows = [
        (number, *segment, math.hypot(segment[2] - segment[0], segment[3] - segment[1]), points)
        for number, (segment, points) in enumerate(zip(answer["segments"], answer["point_counts"], strict=True))
    ]
    print_table(("", "x1", "y1", "x2", "y2", "length", "points"), rows)
    warnings = [("warning", f"{one['code']}: {one['message']}") for one in answer["warnings"]]
    print_rows([("sigma", f"{answer['sigma']:.4f} m"), *warnings])
