"""Small cases whose answer can be worked out by hand, or by a few lines of NumPy."""

from __future__ import annotations

import math

import numpy as np
import pytest

from association import AssociationResult, HardPrior, Status
from registration import MeasuredSegments, RegistrationOptions, RigidTransform, Segments, register, wrap_angle

from .scenes import (
    INSIDE,
    ROOM,
    Floats,
    answer_of,
    carried,
    equal_rooms,
    index_of,
    known,
    pose,
    ring,
    same_pose,
    scan_of,
    seen,
)

# Four walls of different lengths; a scan that sees a part of each, from a place that the other ways round do not fit.
FOUR = ring([(0, 0), (7, 0), (6, 4), (0, 5)])
PARTS = ((0.1, 0.8), (0.2, 0.9), (0.0, 0.7), (0.3, 1.0))
AT = pose(2.5, 1.8, 0.9)
SIGMA = 0.01  # m, of points
COUNTS = np.array([60.0, 40.0, 50.0, 45.0])


def parts_of_four() -> Floats:
    """Return the parts of the four walls, in the map frame."""
    begin, along = FOUR[:, :2], FOUR[:, 2:] - FOUR[:, :2]
    low, high = np.array(PARTS).T
    return np.hstack([begin + low[:, None] * along, begin + high[:, None] * along])


def seen_of_four(offsets: Floats | None = None) -> Floats:
    """Return the parts in the scan frame, each moved along its left normal by its offset."""
    ends = parts_of_four()
    if offsets is not None:
        along = ends[:, 2:] - ends[:, :2]
        normals = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.hypot(*along.T)[:, None]
        ends = ends + np.tile(normals * offsets[:, None], 2)
    return carried(ends, AT.inverse())


def answer_of_four(ends: Floats, map_sigma: float | None = 0.0) -> AssociationResult:
    measured = MeasuredSegments.from_segments(Segments.from_array(ends), SIGMA, COUNTS)
    scan = scan_of(ends)
    return answer_of(index_of(FOUR, map_sigma), type(scan)(measured, (0.0, 0.0)), HardPrior(AT, 2.0, 0.5))


def test_a_room_of_four_walls_and_a_scan_from_a_known_pose() -> None:
    for sigma in (0.0, 0.02, None):
        result = answer_of_four(seen_of_four(), sigma)
        assert (result.status, result.usable) == (Status.OK, True)
        assert same_pose(result.pose, AT, 1e-9, 1e-9)
        assert [(pair.scan, pair.map) for pair in result.correspondences] == [(k, k) for k in range(4)]
        assert result.unmatched_scan == ()
        assert result.missing_map == ()
        for pair in result.correspondences:
            assert (pair.offset, pair.angle) == pytest.approx((0.0, 0.0), abs=1e-9)
            assert pair.overlap == pytest.approx(1.0, abs=1e-9)
            assert pair.alternatives == ()
        assert known(result.diagnostics).inlier_fraction == pytest.approx(1.0)
        assert known(result.diagnostics).pairs == 4
        assert known(result.diagnostics).dof == 5
        assert known(result.diagnostics).chi2 == pytest.approx(0.0, abs=1e-9)


def test_residuals_are_those_of_the_formulas() -> None:
    """Of the contract: ``n_map . (R m_scan + t) - p_map`` and ``wrap(angle(d_map) - angle(d_scan) - theta)``."""
    ends = seen_of_four(np.array([0.01, -0.004, 0.006, -0.012]))
    result = answer_of_four(ends, 0.02)
    at = known(result.pose)
    for pair in result.correspondences:
        begin, end = FOUR[pair.map].reshape(2, 2)
        d = (end - begin) / np.hypot(*(end - begin))
        n = np.array([-d[1], d[0]])
        middle = np.asarray(at.apply(ends[pair.scan].reshape(2, 2))).mean(axis=0)
        assert pair.offset == pytest.approx(float(n @ middle - n @ begin), abs=1e-9)
        seen_along = ends[pair.scan, 2:] - ends[pair.scan, :2]
        turn = math.atan2(d[1], d[0]) - math.atan2(seen_along[1], seen_along[0]) - at.theta
        assert pair.angle == pytest.approx(wrap_angle(turn), abs=1e-9)
        assert pair.weight == pytest.approx(1.0 / (SIGMA**2 / COUNTS[pair.scan] + 0.02**2), rel=1e-6)


def cramer_rao(map_sigma: float) -> Floats:
    """Return the bound of (x, y, theta) for evenly spread points of the parts, each wall with one error of its own.

    By numeric derivatives of the distances of single points from their lines.
    """

    def distances(unknown: Floats) -> Floats:
        at, out = RigidTransform(*unknown[:3].tolist()), []
        for k, (ends, count) in enumerate(zip(seen_of_four(), COUNTS.astype(int).tolist(), strict=True)):
            marks = (np.arange(count) + 0.5) / count
            points = np.asarray(at.apply(ends[:2] + marks[:, None] * (ends[2:] - ends[:2])))
            d = (FOUR[k, 2:] - FOUR[k, :2]) / np.hypot(*(FOUR[k, 2:] - FOUR[k, :2]))
            out.append((points - FOUR[k, :2]) @ [-d[1], d[0]] - unknown[3 + k])
        return np.concatenate(out)

    start, step = np.array([AT.x, AT.y, AT.theta, 0.0, 0.0, 0.0, 0.0]), 1e-6
    columns = [(distances(start + step * e) - distances(start - step * e)) / (2.0 * step) for e in np.eye(7)]
    jacobian = np.stack(columns, axis=1)
    information = jacobian.T @ jacobian / SIGMA**2
    information[3:, 3:] += np.eye(4) / max(map_sigma, 1e-9) ** 2
    return np.asarray(np.linalg.inv(information)[:3, :3])


@pytest.mark.parametrize("map_sigma", [0.0, 0.02])
def test_the_covariance_is_the_cramer_rao_bound(map_sigma: float) -> None:
    """Of an exact map; where walls are off one by one it is not below the bound, in any direction."""
    found = known(answer_of_four(seen_of_four(), map_sigma).covariance)
    ratios = np.linalg.eigvals(np.linalg.solve(cramer_rao(map_sigma), found)).real
    assert ratios.min() >= 0.98
    if map_sigma == 0.0:
        np.testing.assert_allclose(ratios, 1.0, atol=0.02)


def overlap_at(wall: Floats, segment: Floats, at: RigidTransform) -> float:
    """Return the fraction of a scan segment's length that lies along a wall's."""
    d = (wall[2:] - wall[:2]) / np.hypot(*(wall[2:] - wall[:2]))
    along = (np.asarray(at.apply(segment.reshape(2, 2))) - wall[:2]) @ d
    shared = min(along.max(), float((wall[2:] - wall[:2]) @ d)) - max(along.min(), 0.0)
    return float(max(0.0, shared) / np.ptp(along))


@pytest.mark.parametrize("estimator", ["joint", "one_step"])
def test_overlaps_are_those_at_the_pose_that_is_returned(estimator: str) -> None:
    compared = 0
    for seed in range(4):
        ends = seen(ROOM, INSIDE, noise=0.04, cut=0.1, seed=seed)[0]
        result = answer_of(index_of(ROOM), scan_of(ends, 0.04), min_overlap=0.2, estimator=estimator)
        for pair in result.correspondences:
            assert pair.overlap == pytest.approx(
                overlap_at(ROOM[pair.map], ends[pair.scan], known(result.pose)), abs=1e-9
            )
            compared += 1
    assert compared >= 24


def test_a_segment_across_a_doorway_is_reported_on_both_walls() -> None:
    """The pair is the piece that it lies on most; the overlap is that with both."""
    index = index_of([[0, 0, 3, 0], [4, 0, 9, 0], [9, 0, 9, 6], [9, 6, 0, 6], [0, 6, 0, 0]])
    scan = scan_of([[1, 0, 8, 0], [9, 1, 9, 5], [8, 6, 2, 6], [0, 5, 0, 1]])
    result = answer_of(index, scan, HardPrior(pose(), 1.0, 0.3))
    across = next(pair for pair in result.correspondences if pair.scan == 0)
    assert (across.map, across.alternatives) == (1, (0,))
    assert across.overlap == pytest.approx(6.0 / 7.0, abs=1e-6)


@pytest.mark.parametrize("oriented", [True, False])
def test_a_segment_over_several_pieces_of_a_wall_names_them_all(oriented: bool) -> None:
    begin, step = ROOM[0, :2], (ROOM[0, 2:] - ROOM[0, :2]) / 3.0
    pieces = [[*(begin + k * step), *(begin + (k + 0.97) * step)] for k in range(3)]
    ends, truth = seen(ROOM, INSIDE)
    if not oriented:
        ends = ends[:, [2, 3, 0, 1]]
    result = answer_of(index_of(np.vstack([pieces, ROOM[1:]])), scan_of(ends), oriented=oriented)
    assert result.status is Status.OK
    floor = next(pair for pair in result.correspondences if truth[pair.scan] == 0)
    assert {floor.map, *floor.alternatives} == {0, 1, 2}
    assert floor.overlap == pytest.approx(0.98, abs=0.011)


HALL = np.array([[8, 0, 8, 5], [8, 5, 3, 5], [3, 5, 3, 7], [3, 7, 0, 7], [0, 7, 0, 0]], dtype=float)


def with_a_step(step: float) -> Floats:
    """Return the walls of a hall, the lower one with a step of so many metres."""
    return np.vstack([[[0.0, 0.0, 4.5, 0.0], [4.5, step, 8.0, step]], HALL])


@pytest.mark.parametrize("sigma", [0.0, 0.001, 0.003])
@pytest.mark.parametrize("step", [0.012, 0.02, 0.028])
def test_a_map_that_is_stated_to_be_exact_keeps_its_steps(step: float, sigma: float) -> None:
    """A scan of one side of a step in a wall is where that side is."""
    walls = with_a_step(step)
    ends = np.array([[5.0, step, 7.8, step], [8.0, 0.5, 8.0, 4.5], [7.5, 5.0, 3.4, 5.0], [3.0, 5.2, 3.0, 6.8]])
    at = pose(5.0, 2.0, 0.3)
    found = known(answer_of(index_of(walls, sigma), scan_of(carried(ends, at.inverse()), 0.005)).pose)
    assert (found.x, found.y, found.theta) == pytest.approx((at.x, at.y, at.theta), abs=3e-4 + sigma)


@pytest.mark.parametrize("low", [0.0, 0.01, 0.029, 0.05])
def test_a_millimetre_more_of_a_step_changes_the_probability_little(low: float) -> None:
    ends = seen(np.vstack([[[0.4, 0.0, 7.6, 0.0]], HALL[:4]]), pose(4.0, 2.5, 0.4), noise=0.005, cut=0.1, seed=3)[0]
    one, other = (answer_of(index_of(with_a_step(step)), scan_of(ends, 0.01, (0.0, 0.0))) for step in (low, low + 1e-3))
    assert other.probability == pytest.approx(one.probability, abs=0.1)


@pytest.mark.parametrize("sigma", [0.0, 0.001, 0.02])
@pytest.mark.parametrize("seed", range(3))
def test_the_pairs_of_a_plain_answer_register_to_it(seed: int, sigma: float) -> None:
    """With the sigma of the map, each pair alone on its wall; of exact maps with covariance and chi-square.

    So the pose is the least-squares estimate, and the covariance that of its errors, as the tests of `register` show.
    """
    ends = seen(ROOM, INSIDE, noise=0.01, cut=0.4, seed=seed)[0]
    scan = scan_of(ends, 0.01)
    result = answer_of(index_of(ROOM, sigma), scan)
    pairs = [[one.scan, one.map] for one in result.correspondences]
    again = register(Segments.from_array(ROOM), scan.measured, pairs, sigma, RegistrationOptions())
    assert known(result.diagnostics).corrections is None
    assert same_pose(again.pose, result.pose, 1e-6, 1e-6)
    assert again.diagnostics.dof == known(result.diagnostics).dof
    if sigma > 0.0:
        return
    np.testing.assert_allclose(known(again.covariance), known(result.covariance), rtol=1e-6, atol=1e-12)
    assert again.diagnostics.chi2 == pytest.approx(known(result.diagnostics).chi2, rel=1e-6)


@pytest.mark.parametrize("sigma", [0.0, 0.03, None])
def test_an_equal_room_has_the_same_numbers(sigma: float | None) -> None:
    """Ambiguity, reliability, score and covariance."""
    ends = seen(ROOM, INSIDE, noise=0.02, cut=0.4, clutter=2, seed=1)[0]
    result = answer_of(index_of(equal_rooms(2), sigma), scan_of(ends))
    (other,), diagnostics = result.alternatives, result.diagnostics
    assert diagnostics is not None
    assert (other.score, other.inlier_fraction) == pytest.approx((diagnostics.score, diagnostics.inlier_fraction))
    assert other.probability == pytest.approx(result.probability, rel=1e-3)
    assert other.reliability == pytest.approx(diagnostics.reliability)
    for name in ("rotation", "translation"):
        expected = getattr(diagnostics.ambiguity, name)
        assert getattr(other.ambiguity, name) == pytest.approx(expected, rel=1e-6)
    np.testing.assert_allclose(known(other.covariance), known(result.covariance), rtol=1e-6, atol=1e-12)
    assert diagnostics.margin == pytest.approx(0.0, abs=1e-6)
