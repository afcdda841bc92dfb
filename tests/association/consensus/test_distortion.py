"""Maps that are stretched along an axis, or that lean: the pose, its covariance, and the warning."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares

from association import MapIndex, Scan
from association.consensus.distortion import fit_distortion
from association.to_scale import search_to_scale
from registration import RegistrationOptions, RigidTransform, Segments, register
from registration.layout import Floats

from ..scenes import (
    answer_of,
    context_of,
    index_of,
    maze,
    pose,
    pose_in,
    same_pose,
    scan_of,
    seen,
    squared_error,
    warning_codes,
)

WALLS = maze(3, n=70)
LEANING: Floats = np.array([[1.0, 0.01], [0.0, 1.01]])
HERE = (0.0, 0.0)


def distorted(walls: Floats, linear: Floats = LEANING) -> Floats:
    """Return walls as a map shows them whose points are `linear` times those of the building."""
    found: Floats = (walls.reshape(-1, 2) @ linear.T).reshape(-1, 4)
    return found


def truth_in(at: RigidTransform, linear: Floats = LEANING) -> RigidTransform:
    """Return a pose of the building in such a map; its turn is that of the rotation next to the matrix."""
    x, y = (linear @ np.array([at.x, at.y])).tolist()
    return pose(x, y, at.theta + math.atan2(linear[1, 0] - linear[0, 1], linear[0, 0] + linear[1, 1]))


def places(count: int = 12) -> list[RigidTransform]:
    rng = np.random.default_rng(5)
    drawn = [(*rng.uniform(8.0, 22.0, 2).tolist(), float(rng.uniform(-3.0, 3.0))) for _ in range(count)]
    return [pose(x, y, theta) for x, y, theta in drawn]


def scan_at(at: RigidTransform, noise: float = 0.005, seed: int = 0) -> Scan:
    return scan_of(seen(WALLS, at, noise=noise, cut=0.3, seed=seed, radius=11.0)[0], 0.01, viewpoint=HERE)


def test_the_pose_is_that_of_the_robot_in_the_distorted_map() -> None:
    """Rigid poses are off by 1 to 6 cm, 3.6 in the mean. 12.8 is the quantile of 0.5 % of a chi-square of three."""
    index, errors = index_of(distorted(WALLS)), []
    for seed, at in enumerate(places()):
        found, truth = answer_of(index, scan_at(at, seed=seed)), truth_in(at)
        errors.append(math.hypot(pose_in(found).x - truth.x, pose_in(found).y - truth.y))
        assert same_pose(pose_in(found), truth, 0.035, 0.002)
        assert squared_error(found, truth) < 12.8
        assert "map_distorted" in warning_codes(found)
    assert np.mean(errors) < 0.015


def test_the_covariance_holds_whether_the_walls_show_the_distortion_or_not() -> None:
    """Walls are off by 2 cm, too. 95 % of the truths are to be within 7.8; of poses without distortion 60 % are."""
    rng, linear = np.random.default_rng(1), np.array([[1.0, 0.008], [0.0, 1.008]])
    errors = []
    for seed, at in enumerate(places(40)):
        normals = np.stack([WALLS[:, 1] - WALLS[:, 3], WALLS[:, 2] - WALLS[:, 0]], axis=1)
        off = rng.normal(0.0, 0.02, (len(WALLS), 1)) * normals / np.hypot(*normals.T)[:, None]
        found = answer_of(index_of(distorted(WALLS + np.tile(off, 2), linear)), scan_at(at, seed=seed))
        errors.append(squared_error(found, truth_in(at, linear)))
    assert np.mean(np.array(errors) < 7.8) >= 0.85


def test_it_is_the_least_squares_of_pose_and_distortion() -> None:
    """All of it: not linearized, with each wall's error an unknown of its own."""
    index, scan = index_of(distorted(WALLS)), scan_at(places()[0])
    context = context_of(index, scan)
    found = search_to_scale(context)
    answer = found.explanations.answer
    assert answer is not None
    assert found.distortion is not None
    rows, matches = context.lines.rows[answer.best.matched], answer.best.matches[answer.best.matched]
    walls, sigma = context.index.walls.rows[matches["wall"]], answer.estimated.wall_sigma
    assert len(set(matches["wall"].tolist())) == len(rows)  # one line on each wall, so that the variances add up
    variances = 1.0 / rows["weight"] - 0.01**2 + 0.1 * sigma**2

    def residuals(x: Floats) -> Floats:
        c, s = math.cos(x[2]), math.sin(x[2])
        strain = np.eye(2) + np.array([[x[3] + x[4], x[5]], [x[5], x[3] - x[4]]])
        turned = strain @ np.array([[c, -s], [s, c]])
        middles = turned @ np.stack([rows["centroid_x"], rows["centroid_y"]]) + x[:2, None]
        ways = turned @ np.stack([rows["dx"], rows["dy"]])
        offsets = walls["dx"] * middles[1] - walls["dy"] * middles[0] - walls["offset"] - matches["shift"]
        sines = walls["dx"] * ways[1] - walls["dy"] * ways[0]
        return np.concatenate(
            [offsets / np.sqrt(variances + sigma**2), sines * np.sqrt(rows["spread"] / variances), x[3:] / 0.004]
        )

    start = answer.best.pose
    fitted = least_squares(residuals, [start.x, start.y, start.theta, 0.0, 0.0, 0.0], x_scale="jac", xtol=1e-14)
    x, y, theta, _, a, b = fitted.x.tolist()
    assert same_pose(found.distortion.pose, pose(x, y, theta), 2e-4, 2e-5)
    assert found.distortion.strain == pytest.approx(2.0 * math.hypot(a, b), rel=0.02)
    derivatives: Floats = np.asarray(fitted.jac)
    expected = np.linalg.inv(derivatives.T @ derivatives)[:3, :3]
    np.testing.assert_allclose(found.distortion.covariance, expected, rtol=0.05, atol=0.02 * expected.max())


def test_a_large_one_is_told_with_its_direction() -> None:
    """Half a per cent longer along 30 degrees, as much shorter across."""
    turn = np.array([[math.cos(math.pi / 6), -0.5], [0.5, math.cos(math.pi / 6)]])
    index = index_of(distorted(WALLS, turn @ np.diag([1.005, 0.995]) @ turn.T))
    found = [search_to_scale(context_of(index, scan_at(at))).distortion for at in places(4)]
    for one in found:
        assert one is not None
        assert one.large
        assert abs(one.strain - 0.01) < 3.0 * one.deviation < 0.01
        assert one.direction == pytest.approx(math.pi / 6, abs=0.15)
    (told,) = (w for w in answer_of(index, scan_at(places()[0])).warnings if w.code == "map_distorted")
    assert "The map is distorted here: along " in told.message
    assert found[0] is not None
    assert f"{100.0 * found[0].strain:.1f} %" in told.message


def test_an_exact_map_has_none_and_its_pairs_register_to_the_pose() -> None:
    index = index_of(WALLS)
    distorted_answers = 0
    for seed, at in enumerate(places()):
        scan = scan_at(at, seed=seed)
        found, result = search_to_scale(context_of(index, scan)), answer_of(index, scan)
        assert "map_distorted" not in warning_codes(result)
        if found.distortion is not None:
            distorted_answers += 1
            continue
        pairs = np.array([(one.scan, one.map) for one in result.correspondences])
        weights = np.array([one.weight for one in result.correspondences])
        registered = register(index.segments, scan.measured, pairs, 0.02, RegistrationOptions(weights=weights))
        assert registered.pose is not None
        assert same_pose(registered.pose, pose_in(result), 1e-9, 1e-9)
    assert distorted_answers <= 1


@pytest.mark.parametrize(
    ("sigma", "viewpoint", "estimator"),
    [
        (0.0, HERE, "joint"),
        (0.005, HERE, "joint"),
        (0.1, HERE, "joint"),
        (None, None, "joint"),
        (None, HERE, "one_step"),
    ],
)
def test_where_the_map_is_declared_exact_or_rough_or_no_place_is_known_there_is_none(
    sigma: float | None, viewpoint: tuple[float, float] | None, estimator: Any
) -> None:
    index = MapIndex.build(Segments.from_array(distorted(WALLS)), sigma)
    scan = scan_at(places()[0])
    context = context_of(index, Scan(scan.measured, viewpoint, None), estimator=estimator)
    assert search_to_scale(context).distortion is None


def test_a_frame_that_is_not_at_the_sensor_has_the_same_pose() -> None:
    """The frame is fixed to the sensor: 2 m before it, turned by 40 degrees. The fit is linear: micrometres remain."""
    index, by = index_of(distorted(WALLS)), pose(2.0, 0.0, 0.7)
    for at in places(4):
        here = scan_at(at)
        ends = by.inverse().apply(here.measured.segments.endpoints.reshape(-1, 2, 2)).reshape(-1, 4)
        x, y = by.inverse().apply(np.zeros((1, 2)))[0].tolist()
        there = answer_of(index, scan_of(ends, 0.01, viewpoint=(x, y)))
        assert same_pose(pose_in(answer_of(index, here)).compose(by), pose_in(there), 1e-4, 1e-6)


def test_a_scan_to_scale_has_the_uncertainty_of_its_factor() -> None:
    """The map is 2 % too large, and leans. Fitted as if it were to scale, the pose would be known better."""
    linear = 1.02 * LEANING
    index, fitted = index_of(distorted(WALLS, linear)), 0
    for at in places():
        found = search_to_scale(context_of(index, scan_at(at)))
        answer, distortion = found.explanations.answer, found.distortion
        if found.factor is None or distortion is None:
            continue
        fitted += 1
        assert answer is not None
        assert squared_error(answer_of(index, scan_at(at)), truth_in(at, linear)) < 16.3
        plain = fit_distortion(found.context, answer.best, answer.estimated, HERE, to_scale=False)
        assert plain is not None
        assert np.linalg.det(distortion.covariance) > 1.002 * np.linalg.det(plain.covariance)
    assert fitted >= 6


def test_hundreds_of_lines_are_not_inverted() -> None:
    """The time would grow with the cube of their number; 700 walls are all seen."""
    walls = maze(7, n=700, size=120.0)
    scan = scan_of(seen(walls, pose(60.0, 60.0, 0.3))[0], 0.01, viewpoint=HERE)
    context = context_of(index_of(distorted(walls, np.diag([1.0015, 1.0]))), scan)
    found = search_to_scale(context)
    answer = found.explanations.answer
    assert answer is not None
    assert answer.best.matched.sum() > 500
    assert found.distortion is None
