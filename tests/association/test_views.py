"""Several views of one question: sensors of a robot, and the places of a drive."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from association import AssociationResult, HardPrior, Scan, Status, View, assemble, mirrored, scaled
from registration import RigidTransform

from .scenes import (
    INSIDE,
    ROOM,
    Floats,
    answer_of,
    carried,
    drawn_room,
    equal_rooms,
    in_frame,
    index_of,
    is_wrong,
    known,
    maze,
    pose,
    ranges,
    reason_codes,
    same_pose,
    scan_of,
    seen,
    squared_error,
    warning_codes,
    without_beams,
)

INDEX = index_of(ROOM)
ENDS = seen(ROOM, INSIDE, noise=0.01, cut=0.3, seed=4)[0]
STEP = np.diag([0.02**2, 0.02**2, 0.02**2])
WITHIN_95 = 7.815


def view_at(at: RigidTransform, true: RigidTransform | None = None, covariance: Floats | None = None) -> View:
    """Return a scan of ROOM from next to INSIDE, with its stated viewpoint."""
    ends = seen(ROOM, INSIDE.compose(true or at), noise=0.005, seed=5)[0]
    return View(scan_of(ends, viewpoint=(0.0, 0.0)), at, covariance)


# --- Sensors ----------------------------------------------------------------------------------------------------------


def test_one_exact_view_in_the_scans_frame_is_the_scan() -> None:
    scan = scan_of(ENDS)
    assert assemble([View(scan)]) is scan


def test_an_exact_view_is_the_scan_in_the_frame_of_the_robot() -> None:
    scan, mount = ranges(ROOM, INSIDE, 3), pose(0.4, -0.3, 2.0)
    found, expected = assemble([View(scan, mount)]), in_frame(scan, mount)
    np.testing.assert_allclose(found.measured.segments.endpoints, expected.measured.segments.endpoints, atol=1e-12)
    np.testing.assert_allclose(found.measured.centroids, expected.measured.centroids, atol=1e-12)
    assert found.viewpoint == pytest.approx(expected.viewpoint)
    assert found.beams is not None
    assert expected.beams is not None
    np.testing.assert_allclose(found.beams.angles, expected.beams.angles, atol=1e-12)
    np.testing.assert_allclose(known(found.beams.origins), known(expected.beams.origins), atol=1e-12)


@pytest.mark.parametrize("with_beams", [False, True])
def test_two_sensors_see_what_one_does_not(with_beams: bool) -> None:
    """Each looks to one side; alone neither is usable, together they are. The order of the sensors does not matter."""
    room, at = drawn_room(np.random.default_rng(12))
    whole = ranges(room, at, 1)
    angles = np.arctan2(*whole.measured.segments.midpoints.T[::-1])
    index = index_of(room)

    def half(left: bool, mount: RigidTransform) -> View:
        rows = np.nonzero((angles > 0.0) == left)[0]
        one = whole.measured
        columns = {name: getattr(one, name)[rows] for name in ("sigma", "point_counts", "centroids", "spreads")}
        measured = replace(one, segments=one.segments.take(rows), **columns)
        beams = whole.beams
        if beams is not None:
            beams = replace(beams, ranges=np.where((np.sin(beams.angles) > 0.0) == left, beams.ranges, math.nan))
        scan = Scan(measured, (0.0, 0.0), beams if with_beams else None)
        return View(in_frame(scan, mount.inverse()), mount)

    views = [half(True, pose(0.2, 0.1, 1.5)), half(False, pose(-0.3, 0.0, -1.6))]
    one, other = (answer_of(index, assemble(order)) for order in (views, views[::-1]))
    assert one.usable
    assert same_pose(one.pose, at, 0.03, 0.01)
    assert same_pose(one.pose, other.pose, 1e-6, 1e-6)
    assert one.probability == pytest.approx(other.probability, abs=1e-6)
    alone = answer_of(index, whole if with_beams else without_beams(whole))
    assert same_pose(one.pose, alone.pose, 0.01, 0.003)


@pytest.mark.parametrize("with_beams", [False, True])
def test_a_second_view_tells_two_rooms_apart(with_beams: bool) -> None:
    """Equal but for a wall that is not seen from the first place."""
    walls = np.vstack([equal_rooms(2), [[12.0, 8.0, 18.0, 8.0]]])
    index = index_of(walls)
    away = pose(2.0, 3.9, 0.5)  # behind the far wall of the room, as if through a door

    def look(of: Floats, at: RigidTransform) -> Scan:
        ends = seen(of, at, noise=0.005, seed=6)[0]
        beams = ranges(of, at, sigma=1e-4).beams if with_beams else None
        return scan_of(ends, viewpoint=(0.0, 0.0) if with_beams else None, beams=beams)

    first = look(ROOM, INSIDE)
    assert not answer_of(index, first).usable
    outside = look(np.array([[0.0, 8.0, 6.0, 8.0], [5.0, 7.0, 2.0, 7.0]]), INSIDE.compose(away))
    together = answer_of(index, assemble([View(first), View(outside, away)]))
    assert same_pose(together.pose, pose(INSIDE.x + 12.0, INSIDE.y, INSIDE.theta), 0.05, 0.01)


def test_correspondences_and_unmatched_segments_are_numbered_through_all_views() -> None:
    """In the order of the views."""
    clutter = np.array([[0.5, 0.3, 1.5, 1.1]])
    first, second = scan_of(np.vstack([ENDS, clutter])), scan_of(np.vstack([clutter, ENDS]))
    scan = assemble([View(first), View(second)])
    result = answer_of(INDEX, scan)
    count = len(ENDS)
    assert len(scan.measured) == 2 * (count + 1)
    assert set(result.unmatched_scan) >= {count, count + 1}
    found = {pair.scan: pair.map for pair in result.correspondences}
    for k in range(count):
        assert found.get(k) == found.get(k + count + 2)


def test_beams_count_where_every_view_has_them() -> None:
    with_beams = View(ranges(ROOM, INSIDE, 1))
    assert assemble([with_beams, replace(with_beams, pose=pose(0.1))]).beams is not None
    assert assemble([with_beams, View(scan_of(ENDS))]).beams is None


def test_views_scale_and_mirror_with_their_scan() -> None:
    scan = assemble([view_at(pose()), view_at(pose(1.0, 0.5, 0.3), covariance=STEP)])
    for changed, back in ((mirrored(scan), mirrored), (scaled(scan, 2.0), lambda one: scaled(one, 0.5))):
        again = back(changed)
        np.testing.assert_allclose(known(again.views).covariance, known(scan.views).covariance, atol=1e-15)
        np.testing.assert_allclose(known(again.views).viewpoints, known(scan.views).viewpoints)
        np.testing.assert_allclose(again.measured.segments.endpoints, scan.measured.segments.endpoints)


def test_a_mirrored_question_has_the_mirrored_answer() -> None:
    """Of a map and a scan that are both mirrored, with views and an error of odometry."""
    scan = assemble([view_at(pose()), view_at(pose(-1.0, 0.3, 0.2), covariance=STEP)])
    mirror = ROOM[:, [2, 3, 0, 1]] * np.array([1.0, -1.0, 1.0, -1.0])
    one, other = answer_of(INDEX, scan), answer_of(index_of(mirror), mirrored(scan))
    found = known(other.pose)
    assert (one.status, one.usable) == (other.status, other.usable)
    assert one.probability == pytest.approx(other.probability, abs=1e-6)
    assert same_pose(one.pose, pose(found.x, -found.y, -found.theta), 1e-6, 1e-6)


# --- Drives -----------------------------------------------------------------------------------------------------------


def placed(steps: list[RigidTransform], errors: Floats) -> Floats:
    """Return the poses along a drive with these errors of its steps, (v, 3)."""
    at, out = pose(), []
    for step, (x, y, theta) in zip(steps, errors.tolist(), strict=True):
        at = at.compose(RigidTransform(step.x + x, step.y + y, step.theta + theta))
        out.append([at.x, at.y, at.theta])
    return np.array(out)


def test_the_views_of_a_drive_share_the_errors_of_its_steps() -> None:
    """The covariance of all is that of the poses' derivatives by the steps."""
    rng = np.random.default_rng(3)
    steps = [RigidTransform(*(rng.normal(size=3) * [1.0, 0.3, 0.3])) for _ in range(4)]
    roots = [rng.normal(size=(3, 3)) * 0.01 + np.diag([0.03, 0.02, 0.02]) for _ in range(4)]
    nominal = placed(steps, np.zeros((4, 3)))
    views = [View(scan_of(ENDS))]
    views += [View(scan_of(ENDS), RigidTransform(*nominal[k]), roots[k] @ roots[k].T, k) for k in range(4)]
    found = assemble(views).views
    jacobian = np.zeros((12, 12))
    for k in range(12):
        errors = np.zeros(12)
        errors[k] = 1e-6
        jacobian[:, k] = (placed(steps, errors.reshape(4, 3)) - nominal).reshape(-1) / 1e-6
    every = np.zeros((12, 12))
    for k, root in enumerate(roots):
        every[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = root @ root.T
    np.testing.assert_allclose(known(found).covariance[3:, 3:], jacobian @ every @ jacobian.T, atol=1e-7)
    assert not known(found).covariance[:3].any()


def drive(seed: int, *, with_beams: bool, deviation: float = 0.02) -> tuple[Floats, list[View], RigidTransform]:
    """Draw a room, a drive of four views that ends at the truth, and the odometry of its steps with its errors."""
    rng = np.random.default_rng([21, seed])
    room, at = drawn_room(rng)
    spread = np.diag([deviation**2, deviation**2, (0.5 * deviation) ** 2])
    views, true, stated = [], pose(), pose()
    for k in range(4):
        if k:
            step = RigidTransform(rng.uniform(-0.3, -0.1), rng.uniform(-0.05, 0.05), rng.uniform(-0.2, 0.2))
            x, y, theta = rng.multivariate_normal(np.zeros(3), spread)
            true = true.compose(step)
            stated = stated.compose(RigidTransform(step.x + x, step.y + y, step.theta + theta))
        scan = ranges(room, at.compose(true), 100 * seed + k)
        views.append(
            View(scan if with_beams else without_beams(scan), stated, spread if k else None, k - 1 if k else None)
        )
    return room, views, at


@pytest.mark.parametrize("with_beams", [False, True])
def test_drives_with_errors_of_odometry_are_right_with_their_covariances(with_beams: bool) -> None:
    """Of 30 drives; the pose is that of the first view."""
    errors, usable = [], 0
    for seed in range(30):
        room, views, at = drive(seed, with_beams=with_beams)
        result = answer_of(index_of(room), assemble(views))
        assert not is_wrong(result, at)
        if result.usable:
            errors.append(squared_error(result, at))
        usable += result.usable
    assert usable >= 26
    assert 0.02 <= np.mean(errors) <= 4.5
    assert np.mean(np.array(errors) <= WITHIN_95) >= 0.85


def test_an_error_of_odometry_is_estimated_next_to_the_pose() -> None:
    """A step that is 7 cm and 2 degrees off; and then the segments lie on the walls."""
    true, off = pose(-1.0, 0.3, 0.2), pose(-0.95, 0.25, 0.235)
    scan = assemble([view_at(pose()), view_at(off, true, np.diag([0.04**2, 0.04**2, 0.03**2]))])
    result = answer_of(INDEX, scan)
    assert result.status is Status.OK
    assert same_pose(result.pose, INSIDE, 0.02, 0.004)
    assert max(abs(pair.offset) for pair in result.correspondences) < 0.03
    exact = answer_of(INDEX, assemble([view_at(pose()), view_at(off, true)]))
    assert not exact.usable or not same_pose(exact.pose, result.pose, 1e-6, 1e-6)


def test_where_the_frame_of_a_drive_begins_does_not_matter() -> None:
    """The view that is exact comes last, or first."""
    way = pose(-1.0, 0.3, 0.2)
    there = [view_at(pose()), view_at(way, covariance=STEP)]
    one, other = (answer_of(INDEX, assemble(views)) for views in (there, there[::-1]))
    assert (one.status, one.usable) == (other.status, other.usable)
    # The deviation of the place is that where the sensor was last, or first.
    assert one.probability == pytest.approx(other.probability, abs=1e-3)
    assert same_pose(one.pose, other.pose, 1e-6, 1e-6)


def test_a_drive_whose_last_view_is_of_another_place_is_not_usable() -> None:
    """Its other views may fix where these were; the frame of the scan depends on them by odometry alone."""
    places = [pose(), pose(-0.4, 0.2, 0.1), pose(-0.8, 0.1, 0.2), pose(-0.5, -0.4, 0.3)]
    step, elsewhere = np.diag([0.02**2, 0.02**2, 0.005**2]), maze(3)

    def drives(last: Floats) -> Scan:
        views = [View(ranges(last, INSIDE, 5))]
        views += [View(ranges(ROOM, INSIDE.compose(at), 6), at, step) for at in places[1:]]
        return assemble(views)

    assert answer_of(INDEX, drives(ROOM)).usable
    turned = drives(carried(ROOM, RigidTransform(0.0, 0.0, 0.12)))
    for scan in (turned, drives(elsewhere - 12.0)):
        assert not is_wrong(answer_of(INDEX, scan), INSIDE)


@pytest.mark.parametrize("count", [2, 4])
def test_views_of_one_place_are_not_more_evidence(count: int) -> None:
    """Of two equal rooms, however often the robot looks."""
    index = index_of(equal_rooms(2))
    result = answer_of(
        index, assemble([View(ranges(ROOM, INSIDE, k), pose(), STEP if k else None) for k in range(count)])
    )
    assert not result.usable
    assert "similar_place" in reason_codes(result)
    assert known(result.probability) <= 0.55


def test_a_prior_of_a_drive_is_that_of_its_frame() -> None:
    views = [view_at(pose()), view_at(pose(-1.0, 0.3, 0.2), covariance=STEP)]
    index = index_of(equal_rooms(2))
    for k in range(2):
        at = pose(INSIDE.x + 12.0 * k, INSIDE.y, INSIDE.theta)
        result = answer_of(index, assemble(views), HardPrior(at, 0.5, 0.3))
        assert result.usable
        assert same_pose(result.pose, at)
    wrong: AssociationResult = answer_of(index, assemble(views), HardPrior(pose(7.5, 2.0, INSIDE.theta), 0.5, 0.5))
    assert not wrong.usable
    assert "prior_contradicted" in warning_codes(wrong)


def test_a_second_view_fixes_a_corridor() -> None:
    """The first view sees two parallel walls, the second the end."""
    walls = np.array([[0, 0, 30, 0], [30, 0, 30, 2], [30, 2, 0, 2]], dtype=float)
    here, ahead = pose(20.0, 0.9, 0.1), pose(5.0, -0.4, -0.1)
    first = ranges(walls, here, 1, reach=8.0)
    assert answer_of(index_of(walls), first).status is Status.DEGENERATE
    step = np.diag([0.03**2, 0.03**2, 0.01**2])
    second = ranges(walls, here.compose(ahead), 2, reach=8.0)
    result = answer_of(index_of(walls), assemble([View(first), View(second, ahead, step)]))
    assert result.status is not Status.DEGENERATE
    assert same_pose(result.pose, here, 0.15, 0.03)
    along = math.sqrt(known(result.covariance)[0, 0])
    assert 0.01 < along < 0.15, "no better than the covariance of the step"
