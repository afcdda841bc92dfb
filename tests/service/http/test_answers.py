"""Requests whose answers are known: a table for /v1/register, /v1/associate and /v1/vectorize."""

from __future__ import annotations

import math
from typing import Any

import httpx
import numpy as np
import pytest

from linefix.documents import examples
from registration import RigidTransform
from simulation import Scanner
from tests.service.asking import HERE, ORIGIN, answered, pose_json, scanned, seen_from

REGISTER, ASSOCIATE, BATCH, VECTORIZE = "/v1/register", "/v1/associate", "/v1/associate:batch", "/v1/vectorize"
BODIES = {REGISTER: examples.REGISTER, ASSOCIATE: examples.ASSOCIATE, VECTORIZE: {}}
AT = pose_json(HERE)
LEFT, RIGHT = RigidTransform(0.3, 0.2, math.pi / 4), RigidTransform(-0.3, -0.2, -3.0 * math.pi / 4)
VIEW = {"segments": examples.SEEN, "pose": ORIGIN}
CORRIDOR = {"segments": [[-20.0, 0.0, 20.0, 0.0], [20.0, 2.0, -20.0, 2.0]]}
ALONG = [[-3.0, -1.0, 3.0, -1.0], [3.0, 1.0, -3.0, 1.0]]
RECTANGLE = {"segments": [[0, 0, 8, 0], [8, 0, 8, 5], [8, 5, 0, 5], [0, 5, 0, 0]]}
CORNER = {"segments": [[-3.5, 1.0, -3.5, -3.0], [-3.5, -3.0, 2.5, -3.0]]}
REVERSED = {"segments": [[x2, y2, x1, y1] for x1, y1, x2, y2 in examples.SEEN]}
FRONT = Scanner(541, -0.75 * math.pi, 1.5 * math.pi / 540, range_max=30.0, sigma=0.01)
LASER, SAME = scanned(), {(k, k) for k in range(6)}
SEEN = LASER["ranges"]
TURN = np.arange(720) * math.tau / 720 - math.pi
POINTS = (np.array(SEEN)[:, None] * np.stack([np.cos(TURN), np.sin(TURN)], axis=1)).tolist()


def found(distance: float = 1e-6) -> dict[str, Any]:
    """Return what the answer has where the pose is that of the example."""
    return {"status": "ok", "usable": True, "pose": pytest.approx(AT, abs=distance)}


def ranges(told: list[float | None], **more: Any) -> dict[str, Any]:
    return {**LASER, "ranges": told, **more}


def view(mount: RigidTransform, first: int = 0, before: Any = (), last: int = 6) -> dict[str, Any]:
    """Return what a sensor with a mount sees of the room's walls from the first to the last, after something else."""
    return {"segments": [*before, *seen_from(HERE.compose(mount))[first:last]], "pose": pose_json(mount)}


def mounted(*, flipped: bool) -> dict[str, Any]:
    """Return the views of two scanners on opposite corners, the second upside down or not: its left is right then."""
    views = [{"laser": scanned(HERE.compose(one), FRONT), "pose": pose_json(one)} for one in (LEFT, RIGHT)]
    if flipped:
        views[1] |= {"laser": views[1]["laser"] | {"ranges": views[1]["laser"]["ranges"][::-1]}, "flipped": True}
    return {"views": views, "frame_id": "base"}


def of_map(own: bool | None) -> dict[str, Any]:
    return {"segments": examples.WALLS, "oriented": own}


OF_PAPER = {"estimator": "one_step", "rotation": "mitsuta"}
NO_MATCH = {"status": "no_match", "pose": None, "usable": False, "reasons.code": ["not_on_map"]}
DEGENERATE = {"status": "degenerate", "usable": False, "probability": None, "unobservable": len}
# 8 m and 4 m of wall at 5 cm a point, 2 cm of noise each.
REGISTERED = {
    **found(1e-12), "residuals.scan": [0, 1], "residuals.map": [0, 1], "diagnostics.pairs": 2, "diagnostics.dof": 1,
    "residuals.weight": pytest.approx([160 / 4e-4, 80 / 4e-4]), "unobservable": None, "request_id": len,
    "diagnostics.reliability": pytest.approx(2 * (160 * 80) ** 0.5 / 240), "diagnostics.ambiguity_at": None,
}  # fmt: skip
FIELDS_OF_CUT = ("point_counts", "centroids", "spreads", "sigmas", "rms")
# The request, with parts in place of those of an example, and the expected values of the answer, or conditions on them.
ANSWERS: dict[str, tuple[str, dict[str, Any], dict[str, Any]]] = {
    "pairs": (REGISTER, {}, REGISTERED),
    "pairs, i with i by default": (REGISTER, {"correspondences": None}, REGISTERED),
    "pairs, the paper's estimator": (
        REGISTER, {"options": {**OF_PAPER, "evaluate_at": AT, "k_rotation": 2.0}, "weighting": "uniform"},
        {"covariance": None, "pose": pytest.approx(AT, abs=1e-9), "residuals.weight": [1.0, 1.0],
         "diagnostics.ambiguity_at.total": pytest.approx(0.0, abs=1e-9),
         "diagnostics.ambiguity_before.rotation": pytest.approx(2.0 * 2 * (math.pi / 2) ** 2)}),
    "pairs that are parallel": (
        REGISTER, {"correspondences": [[0, 0]]},
        {"status": "degenerate", "usable": False, "covariance": None,
         "unobservable": lambda told: np.abs(told) == pytest.approx([1.0, 0.0], abs=1e-9)}),
    "no pairs": (REGISTER, {"correspondences": []}, {"status": "degenerate", "pose": None, "residuals": []}),
    "pairs with weights": (REGISTER, {"weights": [3.0, 5.0]}, {"residuals.weight": [3.0, 5.0]}),
    **{f"pairs, reversed, of a map that is oriented: {own}, {option}":
       (REGISTER, {"map": of_map(own), "scan": REVERSED, "options": option, "correspondences": None},
        {"usable": usable})
       for own, option, usable in ((None, {}, False), (False, {}, True), (False, {"oriented": True}, False))},
    "segments": (
        ASSOCIATE, {"client_ref": {"n": 1}, "scan": {**examples.ASSOCIATE["scan"], "stamp": [7, "s"]}},
        {**found(), "correspondences": lambda told: {(one["scan"], one["map"]) for one in told} == SAME,
         "frame_id": "map", "child_frame_id": "laser", "stamp": [7, "s"], "client_ref": {"n": 1}, "map": None,
         "unmatched_scan": [], "segments": None, "reasons": [], "search.complete": True,
         "timing_ms": lambda told: told.keys() == {"decode", "search", "total"}}),
    "ranges, one of them null": (
        ASSOCIATE, {"scan": {"laser": ranges([None, *SEEN[1:]], range_min=0.1), "sigma": None}},
        {**found(0.02), "segments": lambda told: len(told) >= len(examples.WALLS), "warnings": []}),
    "ranges that are stuck": (
        ASSOCIATE, {"scan": {"laser": ranges([2.0] * 400 + SEEN[400:])}},
        {"warnings.code": ["stuck_ranges"], "warnings.message": lambda told: told[0].endswith((".", "?"))}),
    "ranges in feet": (
        ASSOCIATE, {"scan": {"laser": ranges([3.28 * r for r in SEEN])}},
        {"warnings.code": lambda told: "scan_exceeds_map" in told}),
    "points": (ASSOCIATE, {"scan": {"points": POINTS}}, found(0.02)),
    **{f"a scan of nothing: {[*scan]}": (ASSOCIATE, {"scan": scan}, NO_MATCH)
       for scan in ({"segments": []}, {"points": []}, {"laser": ranges([None] * 10)})},
    "a single wall": (
        ASSOCIATE, {"scan": {"segments": examples.SEEN[:1]}},
        {"usable": False, "reasons": lambda told: told and {*told[0]} == {"code", "message"}}),
    "a soft prior": (ASSOCIATE, {"prior": {**AT, "covariance": np.diag([0.1] * 3).tolist()}}, {"status": "ok"}),
    "a hard prior": (ASSOCIATE, {"prior": {**AT, "radius": 1.0, "angle": 0.5}}, {"status": "ok"}),
    "the paper's estimator": (ASSOCIATE, {"options": OF_PAPER}, {**found(), "covariance": None}),
    # Its critical wall, down to where alternatives were looked for, and the paper's measures of each alternative.
    "a corner of a rectangle": (
        ASSOCIATE, {"map": RECTANGLE, "scan": CORNER, "options": {"sampling": "random", "seed": 4}},
        {"search.sampling": "random", "search.seed": 4, "search.complete_above": lambda told: 0.5 < told < 1.0,
         "diagnostics.critical_wall": lambda wall: wall["displacement"] > 1.0 and len(wall["scan"] + wall["map"]) == 2,
         "diagnostics.critical_wall.direction": lambda told: math.hypot(*told) == pytest.approx(1.0),
         "alternatives.ambiguity.total": lambda told: told and min(told) >= 0.0,
         "alternatives.reliability": lambda told: 0.0 <= min(told) <= max(told) <= 1.0}),
    "one wall of a corridor": (ASSOCIATE, {"map": CORRIDOR, "scan": {"segments": ALONG[:1]}}, DEGENERATE),
    "both walls of a corridor": (ASSOCIATE, {"map": CORRIDOR, "scan": {"segments": ALONG}}, DEGENERATE),
    "a sensor with its mount": (
        ASSOCIATE, {"scan": {"views": [view(LEFT)], "stamp": 7}},
        {**found(), "child_frame_id": "base_link", "stamp": 7, "segments": [None]}),
    "views, whose segments are named by view and index": (
        ASSOCIATE, {"scan": {"views": [view(LEFT, last=4), view(RIGHT, 2, [[0.5, 0.5, 0.7, 0.9]])]}},
        {**found(1e-3), "unmatched_scan": [{"view": 1, "scan": 0}],
         "correspondences": lambda told: {(one["view"], one["scan"], one["map"]) for one in told}
         == {(0, k, k) for k in range(4)} | {(1, k, k + 1) for k in range(1, 5)}}),
    # Segments are in the frame that the views share.
    **{f"two scanners, one upside down: {flipped}": (
        ASSOCIATE, {"scan": mounted(flipped=flipped)},
        {**found(0.02), "child_frame_id": "base", "correspondences.view": lambda told: {*told} == {0, 1},
         "segments": lambda told: len(told) == 2 and HERE.apply(np.reshape(told[1], (-1, 2)))[:, 0].min() > -4.05})
       for flipped in (False, True)},
    **{f"a step of {variance} m^2 along x, exact otherwise": (
        ASSOCIATE, {"scan": {"views": [VIEW, {**VIEW, "covariance": np.diag([variance, 0, 0]).tolist()}]}}, found(0.02))
       for variance in (0.0, 0.01)},
    # Counter-clockwise, free space on the left: up the wall at x = 2, then back along y = 2.
    "a corner, vectorized": (
        VECTORIZE, examples.VECTORIZE,
        {"segments": lambda told: np.allclose(told, [[2.0, 0.0, 2.0, 2.0], [2.0, 2.0, 0.1, 2.0]], atol=0.05),
         **dict.fromkeys(FIELDS_OF_CUT, lambda told: len(told) == 2)}),
}  # fmt: skip


def at(value: Any, place: str) -> Any:
    """Return what an answer has at a place; of a list, of each of its items."""
    for name in place.split("."):
        value = [one[name] for one in value] if isinstance(value, list) else value[name]
    return value


@pytest.mark.parametrize("asked", ANSWERS)
def test_an_answer_has_what_is_known(client: httpx.Client, asked: str) -> None:
    path, parts, expected = ANSWERS[asked]
    answer = answered(client, path, BODIES[path], **parts)
    for place, value in expected.items():
        told = at(answer, place)
        assert value(told) if callable(value) else told == value, (place, told)


def test_names_that_are_included(client: httpx.Client) -> None:
    names = {"correspondences", "alternatives", "segments", "missing_map"}
    for include in (names, set(), {"missing_map"}):
        answer = answered(client, ASSOCIATE, examples.ASSOCIATE, options={"include": [*include]})
        assert names & answer.keys() == include
    assert names <= answered(client, ASSOCIATE, examples.ASSOCIATE).keys()


def test_the_error_of_the_walls_is_estimated_where_it_is_null(client: httpx.Client) -> None:
    """Or, to associate, where it is left out: sent, or stored."""

    def variance(path: str, where: dict[str, Any] | None = None, **sigma: float | None) -> float:
        parts = {"map": where or {"segments": examples.WALLS, **sigma}, "scan": {"segments": examples.SEEN}}
        if path == REGISTER:
            parts["correspondences"] = None  # type: ignore[assignment]
        answer = answered(client, path, BODIES[path], **parts)
        assert answer["usable"]
        return float(answer["covariance"][0][0])

    assert variance(REGISTER) == variance(REGISTER, sigma=0.0)
    assert variance(ASSOCIATE) == variance(ASSOCIATE, sigma=None)
    for path in (REGISTER, ASSOCIATE):
        assert 3.0 * variance(path, sigma=0.0) < variance(path, sigma=None) < variance(path, sigma=0.05)
    for sigma in ({}, {"sigma": None}, {"sigma": 0.0}):
        document = {"segments": examples.WALLS, **sigma}
        assert client.put("/v1/maps/of-some-error", json=document).is_success
        assert variance(ASSOCIATE, {"map_id": "of-some-error"}) == variance(ASSOCIATE, **sigma)
        assert client.get("/v1/maps/of-some-error").json() == document
    exact = {"scan": {"segments": examples.SEEN, "sigma": 0.0}, "correspondences": None}
    assert answered(client, REGISTER, map={"segments": examples.WALLS, "sigma": None}, **exact)["usable"]


def test_the_prior_of_the_map_and_the_least_probability_decide_what_is_usable(client: httpx.Client) -> None:
    """Of a batch, too."""
    asked = {name: examples.ASSOCIATE[name] for name in ("map", "scan")}
    half, sure = ({"on_map": on_map} for on_map in (0.5, 1.0))
    likely = [answered(client, ASSOCIATE, asked, options=options)["probability"] for options in (half, sure)]
    assert likely[0] < likely[1]
    for options, usable in ((half, False), (sure, True)):
        options = {**options, "usable_from": 0.5 * sum(likely)}
        answer = answered(client, ASSOCIATE, asked, options=options)
        assert (answer["usable"], answer["probability"] >= options["usable_from"]) == (usable, usable)
        assert (answer["status"], answer["reasons"] == []) == ("ok" if usable else "ambiguous", usable)
        together = answered(client, BATCH, map=asked["map"], scans=[asked["scan"]], options=options)
        assert together["results"][0]["result"]["usable"] is usable


def test_a_map_s_directions_count_unless_the_request_says_otherwise(client: httpx.Client) -> None:
    """Stored or sent, alone or in a batch: a scan that runs the other way fits where directions mean nothing."""
    undirected, scan = of_map(False), {**REVERSED, "viewpoint": None}
    client.put("/v1/maps/undirected", json=undirected).raise_for_status()
    for where in ({"map_id": "undirected"}, undirected, {**undirected, "meta": "a file of its own"}):
        for options, usable in (({}, True), ({"oriented": None}, True), ({"oriented": True}, False)):
            assert answered(client, ASSOCIATE, map=where, scan=scan, options=options)["usable"] is usable
            many = answered(client, BATCH, map=where, scans=[scan], options=options)
            assert many["results"][0]["result"]["usable"] is usable
    assert answered(client, ASSOCIATE, map=of_map(None), scan=scan, options={"oriented": False})["usable"]


def test_a_bad_scan_in_a_batch_is_one_error_item(client: httpx.Client) -> None:
    """A prior, or a view that is wrong, too; the others are answered as they are alone."""
    rows = {"segments": [[0, 0, 1, 0], [1, 2, 3]]}
    scans = [{"views": [VIEW]}, rows, {"segments": examples.SEEN}, 5, {"views": [VIEW, {**VIEW, "relative_to": 5}]}]
    priors = [None, None, {**AT, "radius": "far", "angle": 1}, None, None]
    results = answered(client, BATCH, map=of_map(None), scans=scans, priors=priors)["results"]
    assert [one["index"] for one in results] == [*range(5)]
    assert [one["status_code"] for one in results] == [200, 422, 422, 422, 422]
    single = answered(client, ASSOCIATE, map=of_map(None), scan=scans[0])
    for name in ("pose", "correspondences"):
        assert results[0]["result"][name] == single[name]
    pointers = ["/scans/1/segments/1", "/priors/2/radius", "/scans/3", "/scans/4/views/1/relative_to"]
    assert [one["problem"]["errors"][0]["pointer"] for one in results[1:]] == pointers
    corridor = answered(client, BATCH, map=CORRIDOR, scans=[{"segments": ALONG}, {"segments": []}])["results"]
    assert [one["result"]["probability"] for one in corridor] == [None, 0.0]


def test_what_vectorize_gives_can_be_sent_back(client: httpx.Client) -> None:
    cut = answered(client, VECTORIZE, laser=LASER)
    scan = {name: cut[name] for name in ("segments", "point_counts", "centroids", "spreads")}
    answer = answered(client, ASSOCIATE, examples.ASSOCIATE, scan={**scan, "sigma": cut["sigmas"]})
    assert (answer["status"], answer["pose"]) == ("ok", pytest.approx(AT, abs=0.02))
