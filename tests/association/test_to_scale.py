"""Maps with a scale error: pose in the map as sent, covariance with the factor, and a warning."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest

from association import (
    AssociationOptions,
    AssociationResult,
    Deadline,
    HardPrior,
    Scan,
    View,
    assemble,
    associate,
    to_scale,
)
from association.consensus.consensus_set import ConsensusSet
from association.consensus.similarity import Similarity, fit_similarity
from association.context import SearchContext
from association.explanations import Explanations, add_alternatives
from association.rank_and_estimate import search_and_rank
from association.search.candidates import Effort
from association.to_scale import search_to_scale
from registration import RigidTransform, Segments
from registration.layout import Floats
from registration.options import Estimator
from simulation import Scanner, l_room, scan
from vectorization import LaserScan, vectorize

from ..map_quality.check.drawn import faces, sampled
from ..map_quality.check.drawn import index_of as index_of_floor
from .answers import answer_with, explanations_of, ranked
from .consensus.test_estimation import off_by
from .scenes import (
    INSIDE,
    ROOM,
    answer_of,
    context_of,
    equal_rooms,
    index_of,
    maze,
    pose,
    pose_in,
    same_pose,
    scan_of,
    seen,
)

WALLS = maze(1)
AT = pose(15.0, 14.0, 0.5)
HERE = pose()
SCAN = scan_of(seen(WALLS, AT, noise=0.01, seed=1, radius=12.0)[0])


def at_scale(factor: float, at: RigidTransform = AT) -> RigidTransform:
    """Return a place where a map has it that is too large by a factor."""
    return pose(factor * at.x, factor * at.y, at.theta)


def answer(walls: Floats, seed: int = 1, estimator: Estimator = "joint") -> AssociationResult:
    return answer_of(
        index_of(walls), scan_of(seen(WALLS, AT, noise=0.01, seed=seed, radius=12.0)[0]), estimator=estimator
    )


def told(result: AssociationResult) -> list[str]:
    return [warning.message for warning in result.warnings if warning.code == "map_scale"]


def squared_error(result: AssociationResult, truth: RigidTransform) -> float:
    found = pose_in(result)
    error = np.array([found.x - truth.x, found.y - truth.y, math.remainder(found.theta - truth.theta, math.tau)])
    assert result.covariance is not None
    return float(error @ np.linalg.solve(result.covariance, error))


@pytest.mark.parametrize("factor", [0.98, 0.99, 1.01, 1.02])
def test_the_pose_is_where_the_map_has_it(factor: float) -> None:
    """Its covariance holds: 3 is the mean, 16.3 the quantile of 0.1 %."""
    for seed in range(6):
        found = answer(factor * WALLS, seed)
        assert found.usable
        assert same_pose(pose_in(found), at_scale(factor), 0.03, 0.01)
        assert squared_error(found, at_scale(factor)) < 16.3
        assert found.unmatched_scan == ()


def test_pose_and_covariance_are_those_of_the_similarity() -> None:
    """The covariance includes the error of the factor, and the residuals are those at that pose."""
    context = context_of(index_of(1.02 * WALLS), SCAN)
    found = search_to_scale(context)
    one = found.explanations.answer
    assert one is not None
    similarity = fit_similarity(found.context, one.best)
    assert similarity is not None
    assert one.estimated.pose == similarity.pose
    assert one.registered.pose == found.context.in_map(similarity.pose)
    np.testing.assert_array_equal(one.estimated.covariance, similarity.covariance)


@pytest.mark.parametrize(
    ("factor", "deviation", "off"),
    [(1.01, 0.001, True), (0.99, 0.001, True), (1.003, 0.0001, False), (0.997, 0.0001, False), (1.01, 0.01, False)],
)
def test_a_factor_is_tried_where_it_may_matter_and_is_not_noise(factor: float, deviation: float, off: bool) -> None:
    assert to_scale.is_off(Similarity(pose(), np.eye(3), factor, deviation, 5.0)) == off


@pytest.mark.parametrize(
    ("factor", "deviation", "more", "far"),
    [
        (1.05, 0.02, 1.0, True),
        (0.95, 0.02, 1.0, True),
        (1.03, 0.005, 5.0, False),
        (1.05, 0.04, 5.0, False),
        (1.05, 0.005, 0.5, True),  # beyond noise, however few walls there are
        (1.05, 0.02, 0.5, False),
    ],
)
def test_a_factor_that_is_too_great_is_a_doubt(factor: float, deviation: float, more: float, far: bool) -> None:
    assert to_scale.is_far_off(Similarity(pose(), np.eye(3), factor, deviation, more)) == far


@pytest.mark.parametrize("factor", [1.045, 1.055])
def test_no_answer_is_usable_that_hides_a_greater_factor(factor: float) -> None:
    """A pose makes up for part of it: such answers were usable, 0.1 to 0.3 m off with 2 cm stated."""
    index, told_of = index_of_floor(factor * faces()), 0
    for truth, sent in sampled(30):
        for one in (sent, Scan(sent.measured, sent.viewpoint, None)):
            found = associate(index, one)
            there = pose(factor * truth.x, factor * truth.y, truth.theta)
            assert not found.usable or same_pose(pose_in(found), there, 0.05, 0.02)
            told_of += any("more than 4 %" in reason.message for reason in found.reasons)
    assert told_of


@pytest.mark.parametrize("factor", [0.99, 1.02])
def test_the_factor_is_told(factor: float) -> None:
    [message] = told(answer(factor * WALLS))
    assert float(message.split(" times ")[1].split(" ")[0]) == pytest.approx(factor, abs=0.002)


@pytest.mark.parametrize("factor", [1.0, 1.003])
def test_maps_to_scale_are_told_nothing_of(factor: float) -> None:
    assert told(answer(factor * WALLS)) == []


@pytest.mark.parametrize("seed", range(10))
def test_walls_that_are_off_one_by_one_are_no_factor(seed: int) -> None:
    assert told(answer(off_by(WALLS, 0.05, seed), seed)) == []


def test_the_papers_estimator_has_no_factor() -> None:
    assert told(answer(1.02 * WALLS, estimator="one_step")) == []


@pytest.mark.parametrize("mount", [pose(3.0, -0.5, 0.3), pose(-6.0, 2.0, 2.0)])
def test_the_origin_of_the_scans_frame_is_where_the_map_has_it(mount: RigidTransform) -> None:
    """Wherever the sensor is in it."""
    robot = AT.compose(mount.inverse())
    ends = mount.apply(seen(WALLS, AT, noise=0.01, seed=1, radius=12.0)[0].reshape(-1, 2, 2)).reshape(-1, 4)
    scan = scan_of(ends, viewpoint=(mount.x, mount.y))
    found = associate(index_of(1.02 * WALLS), scan, None, AssociationOptions(oriented=False))
    assert told(found) != []
    assert same_pose(pose_in(found), at_scale(1.02, robot), 0.03, 0.01)


def test_residuals_are_those_of_the_scan_to_scale() -> None:
    """Every wall is matched, and none is off by more than noise."""
    found = answer(1.02 * WALLS)
    scan = seen(WALLS, AT, noise=0.01, seed=1, radius=12.0)[0]
    at, where = pose_in(found), float(told(found)[0].split(" times ")[1].split(" ")[0])
    assert len(found.correspondences) == len(scan)
    for one in found.correspondences:
        begin, end = (1.02 * WALLS[one.map]).reshape(2, 2)
        d = (end - begin) / np.hypot(*(end - begin))
        middle = at.apply(where * scan[one.scan].reshape(2, 2)).mean(axis=0)
        off = float(d[0] * (middle - begin)[1] - d[1] * (middle - begin)[0])
        assert max(abs(off), abs(one.offset)) < 0.06


@pytest.mark.parametrize("latest_first", [True, False])
def test_exact_views_are_put_to_scale_together(latest_first: bool) -> None:
    """In whatever order; the pose is that of their frame."""
    way = pose(-5.0, 1.0, -0.3)
    views = []
    for step in (pose(), way):
        ends = seen(WALLS, AT.compose(step), noise=0.01, seed=1, radius=12.0)[0]
        views.append(View(scan_of(ends, viewpoint=(0.0, 0.0)), step))
    scan = assemble(views if latest_first else views[::-1])
    found = associate(index_of(1.02 * WALLS), scan, None, AssociationOptions(oriented=False))
    assert told(found) != []
    assert same_pose(pose_in(found), at_scale(1.02), 0.03, 0.01)


def test_views_that_are_not_exact_are_as_they_were_sent() -> None:
    """Their odometry error may be a scale factor as well. The last one alone, which is exact, has too few walls."""
    ends = seen(WALLS, AT, noise=0.01, seed=1, radius=12.0)[0]
    spread = np.diag([0.02**2, 0.02**2, 0.02**2])
    views = [
        View(scan_of(ends[:2], viewpoint=(0.0, 0.0))),
        View(scan_of(ends[2:], viewpoint=(0.0, 0.0)), HERE, spread),
    ]
    assert told(associate(index_of(1.02 * WALLS), assemble(views), None, AssociationOptions(oriented=False))) == []


def test_a_window_holds_the_pose_in_the_map_as_it_is() -> None:
    """Of two rooms that are alike."""
    index, scan = index_of(1.02 * equal_rooms(2)), scan_of(seen(ROOM, INSIDE)[0], sigma=0.005)
    for shift in (0.0, 12.0):
        at = at_scale(1.02, pose(INSIDE.x + shift, INSIDE.y, INSIDE.theta))
        found = answer_of(index, scan, HardPrior(at, 0.5, 0.1))
        assert told(found) != []
        assert same_pose(pose_in(found), at, 0.03, 0.01)


def test_what_has_no_time_to_be_put_to_scale_is_not_usable(monkeypatch: pytest.MonkeyPatch) -> None:
    index, searched = index_of(1.02 * WALLS), search_and_rank
    in_time = associate(index, SCAN, None, deadline=Deadline(time.monotonic() + 60.0))
    assert in_time.usable

    def late(context: SearchContext, effort: Effort | None = None) -> Explanations:
        if context.scan is not SCAN:
            context.deadline.at = 0.0
        return searched(context, effort)

    monkeypatch.setattr(to_scale, "search_and_rank", late)
    got = associate(index, SCAN, None, deadline=Deadline(time.monotonic() + 60.0))
    assert not got.usable
    assert not got.search.complete
    assert got.reasons[0].code == "search_incomplete"


def test_what_fits_no_better_is_left_as_it_was_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(to_scale, "FACTOR_GAP", 1e6)
    assert told(answer(1.02 * WALLS)) == []


@pytest.mark.parametrize(("most", "scaled"), [(0.015, False), (0.025, True)])
def test_a_factor_that_no_drawing_has_is_none(most: float, scaled: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(to_scale, "MOST_FACTOR", most)
    assert (told(answer(1.02 * WALLS)) != []) == scaled


def test_sides_of_a_room_do_not_fit_another_by_a_factor() -> None:
    """Four walls and a factor leave nothing that could speak against it; ten do."""
    room = np.array([[0.0, 0.0, 9.0, 0.0], [9.0, 0.0, 9.0, 6.0], [9.0, 6.0, 0.0, 6.0], [0.0, 6.0, 0.0, 0.0]])
    assert told(answer_of(index_of(1.02 * room), scan_of(seen(room, pose(3.0, 2.0, 0.4))[0], sigma=0.005))) == []
    assert told(answer_of(index_of(1.02 * ROOM), scan_of(seen(ROOM, INSIDE)[0], sigma=0.005))) != []


@pytest.mark.parametrize("larger", [1.02, 1.03, 1.05])
@pytest.mark.parametrize("where", [0, 1])
@pytest.mark.parametrize("lies", [-1.0, 0.0, 1.0])
def test_two_rooms_that_differ_by_a_factor_are_twins_in_a_map_that_is_off_by_half_of_it(
    larger: float, where: int, lies: float
) -> None:
    """As sent they fit as badly, and each fits well at a scale of its own."""
    both = np.vstack([ROOM, larger * ROOM + np.tile([40.0, 3.0], 2)])
    at = (INSIDE, pose(larger * INSIDE.x + 40.0, larger * INSIDE.y + 3.0, INSIDE.theta))[where]
    scan = scan_of(seen(both[:8] if where == 0 else both[8:], at, noise=0.005, seed=3)[0], sigma=0.01)
    off = larger ** (0.5 * lies)
    found = answer_of(index_of(off * both), scan)
    right = same_pose(pose_in(found), at_scale(off, at), 0.1, 0.02)
    if lies == 0.0:
        assert found.usable
        assert right
        return
    assert right or not found.usable


def test_rivals_at_other_scales_are_put_beside_the_answer() -> None:
    """One of a place that is known counts if it is better, once; none is above the answer or is it again."""
    best, one, other = ranked(100.0), ranked(80.0, at=pose(9.0, 9.0)), ranked(60.0, at=pose(-9.0, 0.0), inside=False)
    known = explanations_of(answer_with(best), one, other)
    assert add_alternatives(explanations_of(None, one), [best]) == explanations_of(None, one)

    def beside(*others: ConsensusSet) -> list[tuple[float, float]]:
        found = add_alternatives(known, others).ranked
        assert found[0] is best
        return [(each.pose.x, each.posterior) for each in found[1:]]

    as_they_are = [(9.0, 80.0), (-9.0, 60.0)]
    assert beside() == as_they_are
    assert beside(ranked(90.0, at=pose(9.5, 9.0))) == [(9.5, 90.0), (-9.0, 60.0)]
    assert beside(ranked(70.0, at=pose(9.5, 9.0))) == as_they_are
    assert beside(ranked(99.0), ranked(120.0)) == as_they_are
    assert beside(ranked(90.0, at=pose(9.5, 9.0, 1.0))) == [(9.5, 90.0), *as_they_are]
    assert beside(ranked(90.0, at=pose(10.5, 9.0))) == [(10.5, 90.0), *as_they_are]
    assert beside(ranked(130.0, 20.0, at=pose(0.0, 20.0))) == [(0.0, 100.0), *as_they_are]
    assert beside(ranked(90.0, at=pose(0.0, 20.0), inside=False)) == [(9.0, 80.0), (0.0, 90.0), (-9.0, 60.0)]


@pytest.mark.parametrize(("error", "asked"), [(0.0, False), (0.05, True)])
def test_what_fits_to_millimetres_is_not_deciding_place_a_factor(
    error: float, asked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[SearchContext] = []

    def counted(context: SearchContext, best: ConsensusSet) -> Similarity | None:
        calls.append(context)
        return fit_similarity(context, best)

    monkeypatch.setattr(to_scale, "fit_similarity", counted)
    answer(off_by(WALLS, error, 2))
    assert (calls != []) == asked


def test_what_is_said_of_the_map_is_believed() -> None:
    """Walls that are off by millimetres are not off by decimetres; those of a grid may be."""
    assert told(answer_of(index_of(1.02 * WALLS, 0.005), SCAN)) == []
    assert told(answer_of(index_of(1.02 * WALLS, 0.025), SCAN)) != []
    assert told(answer_of(index_of(1.02 * WALLS), SCAN)) != []


def test_a_rival_at_a_scale_of_its_own_is_told_once_and_not_above_the_answer() -> None:
    both = np.vstack([ROOM, 1.03 * ROOM + np.tile([40.0, 3.0], 2)])
    off = 1.03**-0.5
    scan = scan_of(seen(ROOM, INSIDE, noise=0.005, seed=3)[0], sigma=0.01)
    found = answer_of(index_of(off * both), scan)
    assert found.diagnostics is not None
    assert told(found) != []
    places = [pose_in(found), *(one.pose for one in found.alternatives)]
    scores = [found.diagnostics.score, *(one.score for one in found.alternatives)]
    assert scores == sorted(scores, reverse=True)
    assert scores[1] > 0.9 * scores[0]
    rooms = [(one.x > 20.0) for one in places[:2]]
    assert sorted(rooms) == [False, True]
    for k, one in enumerate(places):
        assert not any(same_pose(one, other, 0.3, 0.1) for other in places[:k])


@pytest.mark.parametrize("factor", [0.98, 1.02])
@pytest.mark.parametrize("limit", [[3.0, 3.0, 3.0 + 1e-6, 3.0], [-5000.0, 30.0, 5000.0, 30.0]])
def test_a_segment_at_the_limits_of_length_is_put_to_scale_like_any(factor: float, limit: list[float]) -> None:
    """It was refused in the middle of a search."""
    ends = np.vstack([seen(WALLS, AT, noise=0.01, seed=1, radius=12.0)[0], [limit]])
    assert answer_of(index_of(factor * WALLS), scan_of(ends)).pose is not None


@pytest.mark.parametrize("larger", [1.02, 1.03, 1.06])
def test_a_room_of_the_same_shape_is_a_rival_at_its_own_scale(larger: float) -> None:
    """In a map 4.5 % too small the wrong room fits once it is put to scale, and the right one beyond that."""
    room = l_room(8.0, 6.0, 3.0)
    ends = room.map.endpoints
    world = np.vstack([ends, larger * ends + np.tile([14.0, 0.0], 2)])
    index, rng = index_of(0.955 * world), np.random.default_rng(0)
    for place in room.poses[:3]:
        taken = scan(Segments.from_array(world), place, Scanner(sigma=0.01), rng)
        laser = LaserScan(taken.scanner.angle_min, taken.scanner.angle_increment, taken.ranges, 0.0, 20.0)
        walls = vectorize(laser)
        found = associate(index, Scan(walls.measured, (0.0, 0.0), walls.beams))
        assert not (found.usable and told(found))
