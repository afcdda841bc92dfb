"""From walls back to the map's own segments, and to a pose by the estimator that was asked for."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from association import MapIndex, Scan
from association.consensus.acceptance import Accepted, accept, register_accepted
from association.rank_and_estimate import search_and_rank
from association.tables import Lines
from registration import MeasuredSegments, RegistrationOptions, Segments, register

from ..answers import NO_PAIRS, SCAN, estimated_of, ranked, registered_room
from ..kernels.drawn import in_pieces
from ..reference import acceptance as twin
from ..reference.consensus import matches_on
from ..scenes import INSIDE, ROOM, context_of, index_of, local, maze, pose, same_pose, scan_of, seen


def accepted(index: MapIndex, scan: Scan, **options: Any) -> tuple[Accepted, MapIndex]:
    """Return the consensus set of a search, and the index that was searched."""
    context = context_of(index, scan, **options)
    answer = search_and_rank(context).answer
    assert answer is not None
    return accept(context, answer.best), context.index


def test_the_pieces_that_scan_segments_lie_on() -> None:
    """By scan index, on a map whose walls were drawn in many pieces."""
    index, at = in_pieces(np.random.default_rng(1)), pose(15.0, 14.0, 0.5)
    scan = scan_of(seen(maze(1), at, noise=0.02, cut=0.4, clutter=4, radius=9.0)[0])
    context = context_of(index, scan)
    answer = search_and_rank(context).answer
    assert answer is not None
    best, ends = answer.best, scan.measured.segments.endpoints
    lines = Lines(context.lines.rows, context.lines.row_of, 0.5)
    expected = twin.accept_matches(best.matches["wall"], lines, ends, best.pose, index.walls.rows, index.pieces)
    got = answer.accepted
    assert got.scan_indices == [pair[0] for pair in expected]
    assert got.map_indices(index) == got.pairs[:, 1].tolist() == [pair[1] for pair in expected]
    np.testing.assert_allclose(got.overlaps, [pair[2] for pair in expected], atol=4e-4)
    for k, pair in enumerate(expected):
        assert got.others[got.other_starts[k] : got.other_starts[k + 1]].tolist() == pair[3]


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
@pytest.mark.parametrize("fixed", [True, False])
def test_the_pose_is_that_of_registration(estimator: Any, rotation: Any, fixed: bool) -> None:
    """Of the pairs, with the error of the walls; where that is not fixed the estimated one, by the joint estimator."""
    index = index_of(ROOM, 0.03)
    ends = SCAN.measured.segments.endpoints + np.random.default_rng(0).normal(size=(8, 4)) * 0.02
    measured = MeasuredSegments.from_segments(Segments.from_array(ends), 0.05)
    context = context_of(index, Scan(measured, None), estimator=estimator, rotation=rotation)
    truth = seen(ROOM, INSIDE)[1]
    pairs = np.stack([np.arange(8), truth], axis=1)
    at = pose(3.01, 2.52, 0.71)
    estimated = replace(estimated_of(registered_room()), pose=local(index, at), wall_sigma=0.04, free=not fixed)
    walls = np.zeros(8, int)
    walls[context.lines.row_of] = index.wall_of_piece[truth]
    best = replace(ranked(), matches=matches_on(walls))
    found = register_accepted(context, best, replace(NO_PAIRS, pairs=pairs, overlaps=np.ones(8)), estimated)
    options = RegistrationOptions(estimator=estimator, rotation=rotation)
    own = at if estimator == "joint" and not fixed else None
    expected = register(Segments.from_array(ROOM), measured, pairs, 0.03, options, own)
    assert found is not None
    got, registered = found
    assert got.pose == expected.pose
    assert got.pose is not None
    assert same_pose(context.in_map(registered.pose), got.pose, 1e-12, 1e-12) is (estimator == "joint")
    assert same_pose(got.pose, at, 1e-9, 1e-9) is (own is not None)
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
    estimated = estimated_of(registered_room())
    assert register_accepted(context_of(index_of(ROOM), SCAN), ranked(), NO_PAIRS, estimated) is None
