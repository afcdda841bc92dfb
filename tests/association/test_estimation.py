"""Small cases whose answer can be worked out by hand; pose and covariance over many scans."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from association import AssociationResult, HardPrior, Status
from registration import MeasuredSegments, RegistrationOptions, RigidTransform, Segments, register, wrap_angle

from .scenes import (
    INSIDE,
    ROOM,
    Floats,
    Turning,
    answer_of,
    carried,
    drawn_room,
    equal_rooms,
    index_of,
    is_wrong,
    known,
    maze,
    pose,
    ranges,
    ring,
    same_pose,
    scan_of,
    seen,
    squared_error,
    warning_codes,
    without_beams,
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
    ratios = np.linalg.eigvals(np.linalg.solve(known(again.covariance), known(result.covariance))).real
    assert ratios.min() >= 0.98, "in no direction less than walls with errors of their own leave"
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


SCANS = 50
WITHIN_95 = 7.815  # quantile of a chi-square of three
QUARTER = math.radians(90.0)  # per second


@dataclass(frozen=True)
class MapErrors:
    """Errors of a map: walls that are off one by one by so many metres, and a linear distortion."""

    deviation: float = 0.0
    distortion: tuple[tuple[float, float], tuple[float, float]] = ((1.0, 0.0), (0.0, 1.0))

    def of(self, room: Floats, rng: np.random.Generator) -> Floats:
        """Return the walls of a room as the map has them."""
        along = room[:, 2:] - room[:, :2]
        normals = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.hypot(*along.T)[:, None]
        off = room + np.tile(normals * rng.normal(0.0, self.deviation, (len(room), 1)), 2)
        return np.asarray((off.reshape(-1, 2) @ np.array(self.distortion).T).reshape(-1, 4))

    def place(self, at: RigidTransform) -> RigidTransform:
        """Return where the map has a place."""
        x, y = np.array(self.distortion) @ [at.x, at.y]
        return pose(float(x), float(y), at.theta)


AS_BUILT = MapErrors()
OFF = MapErrors(0.02)
LEANING = MapErrors(distortion=((1.01, 0.005), (0.005, 1.0)))


@dataclass(frozen=True)
class Trials:
    """Answers to scans of drawn rooms, with their truths on the map as drawn."""

    answers: tuple[AssociationResult, ...]
    truths: tuple[RigidTransform, ...]

    @property
    def usable(self) -> float:
        return float(np.mean([one.usable for one in self.answers]))

    @property
    def squared_errors(self) -> Floats:
        """Of the usable answers, normalized by their covariances."""
        pairs = zip(self.answers, self.truths, strict=True)
        return np.array([squared_error(one, truth) for one, truth in pairs if one.usable])

    @property
    def deviations(self) -> Floats:
        """Stated deviations of the position of the usable answers, metres."""
        return np.array([math.sqrt(known(one.covariance)[:2, :2].trace()) for one in self.answers if one.usable])

    @property
    def wrong(self) -> int:
        return sum(map(is_wrong, self.answers, self.truths))


def tried(errors: MapErrors = AS_BUILT, sigma: float | None = None, count: int = SCANS, **how: Any) -> Trials:
    """Scan so many drawn rooms, and answer by maps with these errors."""
    with_beams = how.pop("with_beams", True)
    answers, truths = [], []
    for k in range(count):
        rng = np.random.default_rng([7, k])
        room, at = drawn_room(rng)
        scan = ranges(room, at, k, **how)
        answers.append(answer_of(index_of(errors.of(room, rng), sigma), scan if with_beams else without_beams(scan)))
        truths.append(errors.place(at))
    return Trials(tuple(answers), tuple(truths))


@pytest.mark.parametrize(
    ("errors", "sigma", "how", "low", "high"),
    [
        pytest.param(AS_BUILT, None, {}, 0.03, 4.0, id="exact map"),
        pytest.param(AS_BUILT, None, {"with_beams": False}, 0.03, 4.0, id="exact map, as segments"),
        pytest.param(AS_BUILT, 0.0, {}, 0.8, 5.0, id="exact map, stated to be exact"),
        pytest.param(OFF, None, {}, 0.8, 4.5, id="walls off by 2 cm"),
        pytest.param(OFF, None, {"with_beams": False}, 0.8, 4.5, id="walls off by 2 cm, as segments"),
        pytest.param(OFF, 0.02, {}, 0.8, 4.5, id="walls off by 2 cm, stated"),
        pytest.param(AS_BUILT, None, {"bias": 0.02}, 0.03, 4.5, id="ranges too long by 2 cm"),
        pytest.param(AS_BUILT, None, {"bias": -0.02}, 0.03, 4.5, id="ranges too short by 2 cm"),
        pytest.param(LEANING, None, {}, 0.03, 4.5, id="map stretched and leaning"),
        pytest.param(AS_BUILT, None, {"turning": Turning(QUARTER, stated=True)}, 0.03, 4.0, id="rotating, stated"),
    ],
)
def test_the_covariance_is_that_of_the_errors(
    errors: MapErrors, sigma: float | None, how: dict[str, Any], low: float, high: float
) -> None:
    """The mean normalized squared error is 3 where it is right, and less where an error of walls is possible."""
    trials = tried(errors, sigma, **how)
    found = trials.squared_errors
    assert trials.wrong == 0
    assert trials.usable >= 0.85
    assert low <= found.mean() <= high
    assert (found <= WITHIN_95).mean() >= 0.85
    assert np.median(trials.deviations) <= 0.025


@pytest.mark.parametrize("rate", [QUARTER, -QUARTER])
def test_a_rotation_during_the_scan_is_estimated(rate: float) -> None:
    """At ten scans a second it is 9 degrees from first to last beam; the pose is that at the first one."""
    trials = tried(turning=Turning(rate), count=20)
    found = trials.squared_errors
    assert trials.usable >= 0.85
    assert trials.wrong == 0
    assert (found <= WITHIN_95).mean() >= 0.85
    for one in trials.answers:
        if one.usable:
            assert known(one.diagnostics).turn_rate == pytest.approx(rate, abs=0.2)
            assert "turned" in warning_codes(one)


@pytest.mark.parametrize("degrees", [20.0, 45.0])
def test_a_slower_rotation_is_estimated(degrees: float) -> None:
    trials = tried(turning=Turning(math.radians(degrees)), count=25)
    assert trials.wrong == 0
    assert (trials.squared_errors <= WITHIN_95).mean() >= 0.85


@pytest.mark.parametrize("how", [{}, {"turning": Turning(QUARTER, stated=True)}], ids=["at rest", "stated"])
def test_without_a_rotation_none_is_reported(how: dict[str, Any]) -> None:
    for one in tried(count=20, **how).answers:
        assert known(one.diagnostics).turn_rate is None
        assert "turned" not in warning_codes(one)


# --- Maps to another scale --------------------------------------------------------------------------------------------

WALLS = maze(1)
MAZE_AT = pose(15.0, 14.0, 0.5)


def of_maze(factor: float, seed: int = 1, **options: Any) -> AssociationResult:
    """Answer a scan of the maze by a map of it that is larger by a factor."""
    scan = scan_of(seen(WALLS, MAZE_AT, noise=0.01, seed=seed, radius=12.0)[0])
    return answer_of(index_of(factor * WALLS), scan, **options)


@pytest.mark.parametrize("factor", [0.98, 0.99, 1.01, 1.02])
def test_the_pose_is_where_a_map_to_another_scale_has_it(factor: float) -> None:
    """Its covariance holds (16.3 is the quantile of 0.1 %), and the warning states the factor."""
    there = pose(factor * MAZE_AT.x, factor * MAZE_AT.y, MAZE_AT.theta)
    for seed in range(4):
        found = of_maze(factor, seed)
        assert found.usable
        assert same_pose(found.pose, there, 0.03, 0.01)
        assert squared_error(found, there) < 16.3
        assert found.unmatched_scan == ()
        assert "map_scale" in warning_codes(found)
        [message] = [one.message for one in found.warnings if one.code == "map_scale"]
        assert f"{factor:.2f}" in message or any(
            abs(float(word.strip(",.")) - factor) < 0.002 for word in message.split() if word[:2] in ("0.", "1.")
        )


@pytest.mark.parametrize("factor", [1.0, 1.002])
def test_maps_to_scale_have_no_warning(factor: float) -> None:
    for seed in range(6):
        assert "map_scale" not in warning_codes(of_maze(factor, seed))


def test_walls_that_are_off_one_by_one_are_no_factor() -> None:
    for seed in range(8):
        walls = MapErrors(0.05).of(WALLS, np.random.default_rng(seed))
        scan = scan_of(seen(WALLS, MAZE_AT, noise=0.01, seed=seed, radius=12.0)[0])
        assert "map_scale" not in warning_codes(answer_of(index_of(walls), scan))


@pytest.mark.parametrize("factor", [1.045, 1.055])
def test_no_usable_answer_hides_a_greater_factor(factor: float) -> None:
    """A pose makes up for a part of it: such answers would be 0.1 to 0.3 m off with 2 cm stated."""
    for k in range(20):
        room, at = drawn_room(np.random.default_rng([8, k]))
        scan = ranges(room, at, k)
        there = pose(factor * at.x, factor * at.y, at.theta)
        for one in (scan, without_beams(scan)):
            found = answer_of(index_of(factor * room), one)
            assert not found.usable or same_pose(found.pose, there, 0.05, 0.02)


@pytest.mark.parametrize("factor", [0.98, 1.02])
@pytest.mark.parametrize("limit", [[3.0, 3.0, 3.0 + 1e-6, 3.0], [-5000.0, 30.0, 5000.0, 30.0]])
def test_a_segment_at_the_limits_of_length_is_put_to_scale_like_any(factor: float, limit: list[float]) -> None:
    ends = np.vstack([seen(WALLS, MAZE_AT, noise=0.01, seed=1, radius=12.0)[0], [limit]])
    assert answer_of(index_of(factor * WALLS), scan_of(ends)).pose is not None


def test_a_map_that_is_stretched_and_leans_has_a_warning() -> None:
    """By 1 %."""
    warned = [
        bool({"map_distorted", "map_scale"} & set(warning_codes(one))) for one in tried(LEANING, count=20).answers
    ]
    assert np.mean(warned) >= 0.5
