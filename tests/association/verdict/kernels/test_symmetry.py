"""Mirrored view of a map from one pose, at another pose: the same as by the reference, ray by ray and wall by wall."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings

from association import MapIndex, Scan
from association.layout import POINT, RAY, SIGHTING, record
from association.tuning import RAYS
from association.verdict.kernels import symmetry
from association.verdict.tuning import SHORTEST_SHOWN
from registration import RigidTransform, Segments
from registration.layout import Floats, Records

from ...kernels.drawn import GATES, INDEX, PLACE, SEEDS, SMALL, drawn, workspace_of
from ...records import covariance_of, estimate_of, pose_of
from ...reference.geometry import direction, normal
from ...reference.matching import match_scan
from ...reference.sight import first_hit
from ...scenes import ROOM, SQUARE, context_of, index_of, local, pose, scan_of


def shown(at: RigidTransform, viewpoint: Floats, reach: float, index: MapIndex) -> tuple[Floats, Floats]:
    """Return the abscissae between which each wall is seen, by rays that are crossed with all walls."""
    walls = index.walls.rows
    eye = at.apply(viewpoint)
    lows, highs = np.full(len(walls), math.inf), np.full(len(walls), -math.inf)
    for k in range(RAYS):
        angle = math.tau * (k + 0.5) / RAYS
        distance, w = first_hit(eye, angle, reach, walls)
        if w >= 0:
            along = direction(walls[w]) @ (eye + distance * np.array([math.cos(angle), math.sin(angle)]))
            lows[w], highs[w] = min(lows[w], along), max(highs[w], along)
    return lows, highs


def mirrored_ends(at: RigidTransform, walls: Records, lows: Floats, highs: Floats) -> Floats:
    """Return what is seen of the walls in the scan frame with left and right exchanged, (n, 4)."""
    out = []
    for wall, low, high in zip(walls, lows, highs, strict=True):
        if high - low > SHORTEST_SHOWN:
            ends = [abscissa * direction(wall) + wall["offset"] * normal(wall) for abscissa in (high, low)]
            out.append(np.concatenate([at.inverse().apply(end) * [1.0, -1.0] for end in ends]))
    return np.array(out).reshape(-1, 4)


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_what_is_shown_is_mirrored_as_by_the_twin(seed: int) -> None:
    d = drawn(seed)
    viewpoint = d.rng.normal(size=2)
    view, reach = record(POINT, x=viewpoint[0], y=viewpoint[1]), float(d.rng.uniform(2.0, 12.0))
    walls = PLACE.walls
    lows, highs = np.full(len(walls), math.inf), np.full(len(walls), -math.inf)
    symmetry.shown_walls(view[0], estimate_of(d.at)[0], PLACE, reach, record(RAY)[0], lows, highs)
    for got, expected in zip((lows, highs), shown(d.at, viewpoint, reach, INDEX), strict=True):
        np.testing.assert_allclose(got, expected, atol=1e-9)
    lines = symmetry.mirror_walls(estimate_of(d.at)[0], walls, lows, highs)
    expected_ends = Segments.from_array(mirrored_ends(d.at, walls, lows, highs))
    assert len(lines) == len(expected_ends)
    np.testing.assert_allclose(np.stack([lines["x"], lines["y"]], 1), expected_ends.midpoints, atol=1e-9)
    np.testing.assert_allclose(np.stack([lines["dx"], lines["dy"]], 1), expected_ends.directions, atol=1e-9)
    np.testing.assert_allclose(lines["length"], expected_ends.lengths, atol=1e-9)
    np.testing.assert_allclose(lines["angle"], np.arctan2(lines["dy"], lines["dx"]), atol=1e-12)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_the_share_is_that_of_the_gains_that_match(seed: int) -> None:
    """A wall counts as a scan line of its length would; each matched without its neighbours."""
    d = drawn(seed)
    null = estimate_of(d.near(0.5, 4.0, 4.0), SMALL)
    lows, highs = shown(d.at, np.zeros(2), 8.0, INDEX)
    ends = mirrored_ends(d.at, PLACE.walls, lows, highs)
    total = matched = 0.0
    for one in ends:
        row = context_of(INDEX, exact(one[None])).lines.rows
        matched += match_scan(row, pose_of(null[0]), covariance_of(null[0]), PLACE, GATES)[1]
        total += row["gain"][0]
    work = workspace_of(d.scan)
    got = symmetry.mirrored_fraction(record(POINT), as_far_as(8.0), estimate_of(d.at), null, GATES, PLACE, work)
    assert got == pytest.approx(matched / total if total else 0.0, abs=1e-9)


def as_far_as(reach: float) -> Records:
    """Return a line that was seen from the origin up to so far away, metres."""
    return record(SIGHTING, x=0.3 * reach, y=-0.4 * reach, length=reach)


def exact(ends: Floats) -> Scan:
    """Return a scan without noise: what remains of its gates is the model's."""
    return scan_of(ends, 0.0)


def share(walls: Floats, at: RigidTransform, null: RigidTransform, reach: float = 30.0) -> float:
    index = index_of(walls)
    poses = [estimate_of(local(index, one), SMALL) for one in (at, null)]
    work = workspace_of(context_of(index, exact(walls)).lines.rows, index)
    place, seen = index.tables.place, as_far_as(reach)
    return float(symmetry.mirrored_fraction(record(POINT), seen, poses[0], poses[1], GATES, place, work))


def test_a_square_is_its_own_mirror_image() -> None:
    """From any place: seen from the place across its axis with the heading mirrored; not from where it was."""
    at = pose(2.0, 1.2, 0.4)
    assert share(SQUARE, at, pose(2.0, 5.0 - 1.2, -0.4)) == pytest.approx(1.0)
    assert share(SQUARE, at, pose(1.2, 2.0, math.pi / 2 - 0.4)) == pytest.approx(1.0)
    assert share(SQUARE, at, at) < 0.3


def test_a_room_with_a_niche_is_not() -> None:
    at = pose(3.0, 2.5, 0.7)
    others = [pose(3.0, 7.0 - 2.5, -0.7), pose(9.0 - 3.0, 2.5, math.pi - 0.7), pose(2.5, 3.0, math.pi / 2 - 0.7)]
    assert max(share(ROOM, at, other) for other in others) < 0.6


def test_what_is_out_of_reach_does_not_count() -> None:
    """A corridor's end that only one side has; and where nothing is seen nothing is symmetric."""
    walls = np.array([[0.0, 0.0, 20.0, 0.0], [20.0, 2.0, 0.0, 2.0], [20.0, 0.0, 20.0, 2.0]])
    at, across = pose(8.0, 1.0), pose(12.0, 1.0, math.pi)
    assert share(walls, at, across, 6.0) == pytest.approx(1.0)
    assert share(walls, at, across, 30.0) < 0.9
    assert share(walls, at, across, 0.5) == 0.0
