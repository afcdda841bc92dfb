"""From walls back to the map's own segments, and to a pose by the estimator that was asked for."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from association import MapIndex, Scan
from association.acceptance import Accepted, accept, register_accepted
from association.explain import search_and_explain
from association.tables import Lines
from registration import MeasuredSegments, RegistrationOptions, Segments, register

from .answers import NO_PAIRS, SCAN, registered_room, settled_of
from .kernels.drawn import in_pieces
from .reference import acceptance as twin
from .scenes import INSIDE, ROOM, context_of, index_of, local, maze, pose, same_pose, scan_of, seen


def accepted(index: MapIndex, scan: Scan, **options: Any) -> tuple[Accepted, MapIndex]:
    """Return the consensus set of a search, and the index that was searched."""
    context = context_of(index, scan, **options)
    answer = search_and_explain(context).answer
    assert answer is not None
    return accept(context, answer.best), context.index


def test_the_pieces_that_scan_segments_lie_on() -> None:
    """By scan index, on a map whose walls were drawn in many pieces."""
    index, at = in_pieces(np.random.default_rng(1)), pose(15.0, 14.0, 0.5)
    scan = scan_of(seen(maze(1), at, noise=0.02, cut=0.4, clutter=4, radius=9.0)[0])
    context = context_of(index, scan)
    answer = search_and_explain(context).answer
    assert answer is not None
    best, ends = answer.best, scan.measured.segments.endpoints
    lines = Lines(context.lines.rows, context.lines.row_of, 0.5)
    expected = twin.accept_matches(best.matches["wall"], lines, ends, best.pose, index.walls.rows, index.pieces)
    got = answer.accepted
    assert got.scan_indices == [pair[0] for pair in expected]
    assert got.map_indices(index) == got.pairs[:, 1].tolist() == [pair[1] for pair in expected]
    np.testing.assert_allclose(got.overlaps, [pair[2] for pair in expected], atol=4e-4)
    for k, pair in enumerate(expected):
        assert got.rivals[got.rival_starts[k] : got.rival_starts[k + 1]].tolist() == pair[3]


def test_map_indices_are_those_that_were_sent() -> None:
    """Of a map that is listed both ways; the pairs name the piece that runs as the scan segment does."""
    endpoints, truth = seen(ROOM, INSIDE)
    endpoints[::2] = endpoints[::2][:, [2, 3, 0, 1]]
    found, index = accepted(index_of(ROOM), scan_of(endpoints), oriented=False)
    assert found.map_indices(index) == truth.tolist()
    assert (found.pairs[:, 1] % 8).tolist() == truth.tolist()
    reversed_pieces = found.pairs[:, 1] >= 8
    assert reversed_pieces.tolist() in ([True, False] * 4, [False, True] * 4)


@pytest.mark.parametrize("estimator", ["joint", "one_step"])
@pytest.mark.parametrize("rotation", ["wahba", "mitsuta"])
def test_the_pose_is_that_of_registration(estimator: Any, rotation: Any) -> None:
    """Of the pairs, with the error of the walls; by the joint estimator the settled one, else one of its own."""
    index = index_of(ROOM, 0.03)
    ends = SCAN.measured.segments.endpoints + np.random.default_rng(0).normal(size=(8, 4)) * 0.02
    measured = MeasuredSegments.from_segments(Segments.from_array(ends), 0.05)
    context = context_of(index, Scan(measured, None), estimator=estimator, rotation=rotation)
    truth = seen(ROOM, INSIDE)[1]
    pairs = np.stack([np.arange(8), truth], axis=1)
    at = pose(3.01, 2.52, 0.71)
    settled = replace(settled_of(registered_room()), pose=local(index, at), wall_sigma=0.04)
    got = register_accepted(context, replace(NO_PAIRS, pairs=pairs, overlaps=np.ones(8)), settled)
    options = RegistrationOptions(estimator=estimator, rotation=rotation)
    own = at if estimator == "joint" else None
    expected = register(Segments.from_array(ROOM), measured, pairs, 0.04, options, own)
    assert got is not None
    assert got.pose == expected.pose
    assert got.pose is not None
    assert same_pose(got.pose, at, 1e-9, 1e-9) is (estimator == "joint")
    assert (got.diagnostics, got.weights.tolist()) == (expected.diagnostics, expected.weights.tolist())


def test_the_ways_to_register_differ() -> None:
    """Else the test above says nothing."""
    ends = SCAN.measured.segments.endpoints + np.random.default_rng(0).normal(size=(8, 4)) * 0.02
    measured = MeasuredSegments.from_segments(Segments.from_array(ends), 0.05)
    pairs = np.stack([np.arange(8), seen(ROOM, INSIDE)[1]], axis=1)
    ways = [
        ("joint", "wahba", 0.03),
        ("one_step", "wahba", 0.03),
        ("one_step", "mitsuta", 0.03),
        ("joint", "wahba", 0.0),
    ]
    found = [
        register(Segments.from_array(ROOM), measured, pairs, sigma, RegistrationOptions(estimator=e, rotation=r))  # type: ignore[arg-type]
        for e, r, sigma in ways
    ]
    assert len({repr((one.pose, one.weights)) for one in found}) == len(ways)


def test_without_pairs_there_is_no_pose() -> None:
    assert register_accepted(context_of(index_of(ROOM), SCAN), NO_PAIRS, settled_of(registered_room())) is None
