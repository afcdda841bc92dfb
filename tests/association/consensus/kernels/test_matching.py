"""A scan is matched to the walls as its reference says, and no pose is given up that could have scored."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from association import AssociationOptions
from association.consensus.kernels import geometry, matching, raster
from association.layout import FIGURE, HYPOTHESIS, MATCH, record
from association.scan.scan_lines import gates
from association.tables import Raster
from registration import RigidTransform
from registration.layout import Floats, Records

from ...kernels.drawn import GATES, INDEX, PLACE, SEEDS, TABLES, covariance, drawn
from ...records import NOTHING_KNOWN, assert_records, estimate_of
from ...reference import matching as twin
from ...reference.geometry import moved
from ...scenes import context_of, index_of, local, pose, scan_of

WIDE = gates(AssociationOptions(offset_tolerance=0.3, angle_tolerance=0.2, min_overlap=0.1))


def test_wrap() -> None:
    for angle in (*np.linspace(-20.0, 20.0, 81), math.pi - 1e-9, 1e-9 - math.pi):
        assert geometry.wrap(angle) == pytest.approx(math.remainder(angle, math.tau), abs=1e-12)


@given(SEEDS, st.sampled_from([GATES, WIDE]))
@settings(max_examples=60, deadline=None)
def test_match_scan(seed: int, gates: Records) -> None:
    d = drawn(seed)
    at, spread = d.near(), covariance(d.rng)
    expected, total = twin.match_scan(d.scan, at, spread, PLACE, gates)
    matches = np.zeros(len(d.scan), MATCH)

    def got(threshold: float) -> float:
        possible = d.scan["gain"].copy()
        return matching.match_scan(d.scan, estimate_of(at, spread)[0], PLACE, gates[0], possible, threshold, matches)

    assert got(0.0) == pytest.approx(total)
    found = expected["wall"] >= 0
    assert found.any()
    np.testing.assert_array_equal(matches["wall"], expected["wall"])
    np.testing.assert_array_equal(matches["overlap"][~found], 0.0)
    assert_records(matches[found], expected[found], atol=1e-9)
    assert got(total - 1e-6) == pytest.approx(total)
    assert got(total + 1e-6) == -1.0


@pytest.mark.parametrize(("gap", "overlap"), [(1.0, 4.0 / 6.0), (2.0, 0.5)])
def test_a_long_segment_bridges_a_doorway(gap: float, overlap: float) -> None:
    """It lies on the walls on both sides; the gap counts against it, and a wider one is none that it bridges."""
    index = index_of([[0.0, 0.0, 3.0, 0.0], [3.0 + gap, 0.0, 9.0, 0.0], [9.0, 5.0, 0.0, 5.0]])
    scan = context_of(index, scan_of([[0.0, 0.0, 6.0, 0.0]])).lines.rows
    matches = np.zeros(1, MATCH)
    at, place = estimate_of(local(index, pose()))[0], index.tables.place
    matching.match_scan(scan, at, place, GATES[0], scan["gain"].copy(), 0.0, matches)
    assert matches["overlap"][0] == pytest.approx(overlap)


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_long_segments_on_walls_with_doorways(seed: int) -> None:
    """Several doorways of several widths, from both sides."""
    rng = np.random.default_rng(seed)
    ends = np.cumsum(rng.uniform([0.3, 0.4], [3.0, 1.8], (6, 2)).ravel()).reshape(-1, 2)
    walls = [[ends[k - 1, 1] if k else 0.0, 0.0, ends[k, 0], 0.0] for k in range(6)]
    index = index_of([*walls, [20.0, 5.0, 0.0, 5.0]])
    begin, length = rng.uniform(-1.0, 8.0), rng.uniform(2.0, 9.0)
    scan = context_of(index, scan_of([[begin, 0.05, begin + length, 0.05]])).lines.rows
    loose, at = gates(AssociationOptions(min_overlap=0.0)), local(index, pose())
    matches = np.zeros(1, MATCH)
    matching.match_scan(scan, estimate_of(at)[0], index.tables.place, loose[0], scan["gain"].copy(), 0.0, matches)
    expected, _ = twin.match_scan(scan, at, NOTHING_KNOWN, index.tables.place, loose)
    assert_records(matches, expected, atol=1e-9)


@given(SEEDS, st.floats(0.0, 1e-2), st.sampled_from([GATES, WIDE]))
@settings(max_examples=20, deadline=None)
def test_gates_about(seed: int, theta_var: float, gates: Records) -> None:
    d = drawn(seed)
    spreads, shifts, later = np.zeros(len(d.scan)), np.zeros(len(d.scan), np.int64), np.zeros(len(d.scan))
    pin, slip = d.rng.uniform(-5.0, 5.0, 2), float(d.rng.uniform(0.0, 0.3))
    figure = record(FIGURE, angle_variance=theta_var, pin_x=pin[0], pin_y=pin[1], slip=slip)
    raster.gates_about(d.scan, figure[0], gates[0], spreads, shifts, later)
    expected, begins = twin.gates_about(d.scan, theta_var, pin, slip, gates)
    np.testing.assert_allclose(spreads, expected, rtol=1e-12)
    assert shifts.tolist() == begins.tolist()
    assert later.tolist() == d.scan["later_gain"].tolist()


def may_score(
    scan: Records,
    poses: Sequence[RigidTransform],
    floors: Sequence[float],
    spreads: Floats,
    shifts: Any,
    place: Raster,
) -> tuple[list[bool], Floats]:
    """Return of each pose whether the scan may come to its floor there, and what each line can add."""
    posed, near = np.zeros(len(poses) + 1, HYPOTHESIS), np.zeros((len(scan), len(poses) + 1), np.uint8)
    later = np.array([scan["gain"][i + 1 :][shifts[i + 1 :] >= 0].sum() for i in range(len(scan))])
    for one, at, floor in zip(posed, poses, floors, strict=False):
        one["x"], one["y"], one["theta"], one["floor"] = at.x, at.y, at.theta, floor
        one["cosine"], one["sine"] = math.cos(at.theta), math.sin(at.theta)
    raster.may_score(scan, posed, len(poses), spreads, shifts, later, place, near)
    return [bool(told) for told in posed["possible"][:-1]], np.where(near.T[:-1], scan["gain"], -1.0)


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_may_score(seed: int) -> None:
    """The bound is what the reference adds up, no matching exceeds it, and what can lie nowhere needs no matching."""
    d = drawn(seed)
    theta_var, pin, slip = 10.0 ** d.rng.uniform(-6.0, -3.0), d.rng.uniform(-5.0, 5.0, 2), d.rng.uniform(0.0, 0.2)
    spreads, shifts = twin.gates_about(d.scan, theta_var, pin, slip, GATES)
    matches, others = np.zeros(len(d.scan), MATCH), np.zeros(len(d.scan), MATCH)
    places = [d.at, d.near(0.3, 3.0, 3.0), d.near(2.0, 9.0, 9.0)]
    bounds = [twin.reachable(d.scan, at, spreads, shifts, TABLES.raster) for at in places]

    def told(margin: float) -> tuple[list[bool], Floats]:
        return may_score(d.scan, places, [bound + margin for bound in bounds], spreads, shifts, TABLES.raster)

    assert told(1e-6)[0] == [False] * 3
    told_so, gains = told(-1e-6)
    assert told_so == [True] * 3
    for at, bound, possible in zip(places, bounds, gains, strict=True):
        x, y = RigidTransform(0.0, 0.0, at.theta + d.rng.choice([-slip, 0.0, slip])).apply(pin)
        turning = np.array([y, -x, 1.0])
        one = estimate_of(at, theta_var * np.outer(turning, turning))[0]
        assert possible[possible > 0.0].sum() == pytest.approx(bound)
        np.testing.assert_array_equal(possible[possible > 0.0], d.scan["gain"][possible > 0.0])
        total = matching.match_scan(d.scan, one, PLACE, GATES[0], d.scan["gain"].copy(), 0.0, others)
        assert total <= bound + 1e-9
        assert matching.match_scan(d.scan, one, PLACE, GATES[0], possible, total - 1e-9, matches) == total
        np.testing.assert_array_equal(matches["wall"], others["wall"])
    far = moved(d.at, [0.0, 1e3, 0.0])
    # Each of many is tested separately.
    floors = [bound + 1e-6 if k == 1 else bound - 1e-6 for k, bound in enumerate(bounds)]
    told_so, gains = may_score(d.scan, [*places, far], [*floors, 1e-9], spreads, shifts, TABLES.raster)
    assert told_so == [True, False, True, False]
    assert gains[3, 0] < 0.0


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_what_is_not_looked_up_counts_for_nothing_and_may_be_matched(seed: int) -> None:
    d = drawn(seed)
    spreads, shifts = twin.gates_about(d.scan, 1e-4, np.zeros(2), 0.0, GATES)
    skipped = d.rng.random(len(d.scan)) < 0.4
    shifts[skipped] = -1
    at = d.near(0.3, 3.0, 3.0)
    bound = twin.reachable(d.scan[~skipped], at, spreads[~skipped], shifts[~skipped], TABLES.raster)
    told, gains = may_score(d.scan, [at, at], [bound - 1e-6, bound + 1e-6], spreads, shifts, TABLES.raster)
    assert told == [True, False]
    np.testing.assert_array_equal(gains[0][skipped], d.scan["gain"][skipped])
    assert np.maximum(gains[0][~skipped], 0.0).sum() == pytest.approx(bound)


def test_a_pose_over_a_doorway_may_score() -> None:
    """The raster has the direction of a run also where its walls are farther away than they are listed."""
    segments = context_of(INDEX, scan_of([[0.0, 0.0, 6.0, 0.0]])).lines.rows
    (spreads, shifts), matches = twin.gates_about(segments, 0.0, np.zeros(2), 0.0, GATES), np.zeros(1, MATCH)
    for jamb in np.linspace(3.0, 3.5, 11):
        index = index_of([[0.0, 0.0, jamb, 0.0], [jamb + 1.45, 0.0, 9.0, 0.0], [9.0, 5.0, 0.0, 5.0]])
        for slide in np.linspace(-3.0, 6.0, 46):
            at = local(index, pose(float(slide)))
            gains = segments["gain"].copy()
            total = matching.match_scan(segments, estimate_of(at)[0], index.tables.place, GATES[0], gains, 0.0, matches)
            assert may_score(segments, [at], [total - 1e-9], spreads, shifts, index.raster)[0] == [True], (jamb, slide)
