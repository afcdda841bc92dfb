"""Several views of one question: put together, laid on one another, and estimated with their errors."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from association import Deadline, InvalidSearchError, Scan, Status, View, assemble, mirrored
from association.consensus.tuning import ROUGH_FRACTION, SPRING
from association.consensus.view_estimation import SeenOnWalls
from association.layout import SIGHTING, WALL
from association.rank_and_estimate import search_and_rank
from association.scan.alignment import aligned
from association.scan.scan import Views, scaled
from association.scan.scan_lines import parts_of
from association.scan.views import corrected
from association.verdict.tuning import LEAST_IN_STEP
from association.verdict.verdict import judge
from registration import RigidTransform
from registration.layout import Floats

from ..answers import features_of
from ..scenes import (
    INSIDE,
    ROOM,
    answer_of,
    beams_of,
    context_of,
    equal_rooms,
    index_of,
    pose,
    pose_in,
    same_pose,
    scan_of,
    seen,
)

INDEX = index_of(ROOM)
ENDS = seen(ROOM, INSIDE, noise=0.01, cut=0.3, seed=4)[0]
STEP = np.diag([0.02**2, 0.02**2, 0.02**2])


def view_at(at: RigidTransform, true: RigidTransform | None = None, covariance: Floats | None = None) -> View:
    """Return a scan of ROOM from next to INSIDE, with its stated viewpoint."""
    ends = seen(ROOM, INSIDE.compose(true or at), noise=0.005, seed=5)[0]
    return View(scan_of(ends, viewpoint=(0.0, 0.0)), at, covariance)


def test_one_exact_view_in_the_scans_frame_is_the_scan() -> None:
    scan = scan_of(ENDS)
    assert assemble([View(scan)]) is scan


def test_the_answer_is_the_pose_of_the_frame_that_views_share() -> None:
    """Whatever the mount is, upside down too."""
    mount = pose(0.4, -0.3, 2.0)
    ends = mount.inverse().apply(ENDS.reshape(-1, 2, 2)).reshape(-1, 4)
    here, there = answer_of(INDEX, scan_of(ENDS)), answer_of(INDEX, assemble([View(scan_of(ends), mount)]))
    assert same_pose(pose_in(there), pose_in(here), 1e-6, 1e-7)
    upside_down = mirrored(scan_of(ends))  # what a sensor on its head would say
    turned = answer_of(INDEX, assemble([View(mirrored(upside_down), mount)]))
    assert same_pose(pose_in(turned), pose_in(here), 1e-6, 1e-7)


def test_a_scan_split_into_two_views_answers_as_one() -> None:
    whole = answer_of(INDEX, scan_of(ENDS, viewpoint=(0.0, 0.0)))
    halves = [View(scan_of(part, viewpoint=(0.0, 0.0))) for part in (ENDS[::2], ENDS[1::2])]
    split = answer_of(INDEX, assemble(halves))
    assert (split.status, split.usable) == (whole.status, whole.usable)
    assert same_pose(pose_in(split), pose_in(whole), 1e-6, 1e-6)
    assert len(split.correspondences) == len(whole.correspondences)
    assert split.probability == pytest.approx(whole.probability, abs=0.02)


def test_what_two_views_see_is_one_piece_of_evidence() -> None:
    """Walls of the map, and things that are on none: the same object twice does not count more."""
    clutter = np.vstack([ENDS, seen(ROOM, INSIDE, clutter=3, seed=9)[0][-3:]])
    once = context_of(INDEX, scan_of(clutter))
    twice = context_of(INDEX, assemble([View(scan_of(clutter)), View(scan_of(clutter))]))
    assert len(twice.lines.rows) == len(once.lines.rows)
    assert twice.lines.rows["gain"].sum() == pytest.approx(once.lines.rows["gain"].sum())
    np.testing.assert_allclose(twice.lines.rows["weight"], once.lines.rows["weight"], rtol=1e-6)
    assert len(twice.lines.sightings) == 2 * len(once.lines.sightings)


@pytest.mark.parametrize("with_beams", [False, True])
def test_a_second_view_tells_two_rooms_apart(with_beams: bool) -> None:
    """Equal but for a wall that is not seen from the first place."""
    walls = np.vstack([equal_rooms(2), [[12.0, 8.0, 18.0, 8.0]]])
    index = index_of(walls)
    away = pose(2.0, 3.9, 0.5)  # behind the far wall of the room, as if through a door

    def look(of: Floats, at: RigidTransform) -> Scan:
        beams = beams_of(index_of(of), at) if with_beams else None
        return scan_of(seen(of, at, noise=0.005, seed=6)[0], viewpoint=(0.0, 0.0) if with_beams else None, beams=beams)

    first = look(ROOM, INSIDE)
    alone = answer_of(index, first)
    assert not alone.usable
    outside = look(np.array([[0.0, 8.0, 6.0, 8.0], [5.0, 7.0, 2.0, 7.0]]), INSIDE.compose(away))
    together = answer_of(index, assemble([View(first), View(outside, away)]))
    assert same_pose(pose_in(together), pose(INSIDE.x + 12.0, INSIDE.y, INSIDE.theta), 0.05, 0.01)


def test_views_in_a_circle_are_refused() -> None:
    scan = scan_of(ENDS)
    with pytest.raises(InvalidSearchError) as caught:
        assemble([View(scan), View(scan, relative_to=2), View(scan, relative_to=1)])
    assert caught.value.argument == "scan.views.1.relative_to"
    with pytest.raises(InvalidSearchError):
        assemble([View(scan, relative_to=1)])
    with pytest.raises(InvalidSearchError):
        assemble([])


def chain(rng: np.random.Generator, count: int = 4) -> tuple[list[RigidTransform], list[Floats]]:
    """Return the steps of a drive and their covariances."""
    steps = [RigidTransform(*(rng.normal(size=3) * [1.0, 0.3, 0.3])) for _ in range(count)]
    roots = [rng.normal(size=(3, 3)) * 0.01 + np.diag([0.03, 0.02, 0.02]) for _ in range(count)]
    return steps, [root @ root.T for root in roots]


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
    steps, covariances = chain(rng)
    nominal = placed(steps, np.zeros((4, 3)))
    views = [View(scan_of(ENDS))]
    views += [View(scan_of(ENDS), RigidTransform(*nominal[k]), covariances[k], k) for k in range(4)]
    found = assemble(views).views
    assert found is not None
    jacobian = np.zeros((12, 12))
    for k in range(12):
        errors = np.zeros(12)
        errors[k] = 1e-6
        jacobian[:, k] = (placed(steps, errors.reshape(4, 3)) - nominal).reshape(-1) / 1e-6
    every = np.zeros((12, 12))
    for k, covariance in enumerate(covariances):
        every[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = covariance
    np.testing.assert_allclose(found.covariance[3:, 3:], jacobian @ every @ jacobian.T, atol=1e-7)
    assert not found.covariance[:3].any()


def on_walls(rng: np.random.Generator, views: Views) -> SeenOnWalls:
    """Return what views show of four walls, each of them every one, where they should be at the origin."""
    walls, sights = np.zeros(4, WALL), []
    for w, angle in enumerate((0.1, 1.5, 3.0, 4.4)):
        walls[w]["dx"], walls[w]["dy"], walls[w]["offset"] = math.cos(angle), math.sin(angle), -3.0 - w
    for v in range(len(views)):
        for w, wall in enumerate(walls):
            one = np.zeros(1, SIGHTING)
            along = rng.uniform(-2.0, 2.0)
            one["sensor"], one["row"], one["dx"], one["dy"] = v, w, wall["dx"], wall["dy"]
            one["centroid_x"] = along * wall["dx"] - wall["offset"] * wall["dy"]
            one["centroid_y"] = along * wall["dy"] + wall["offset"] * wall["dx"]
            one["spread"], one["variance"] = rng.uniform(0.1, 1.0), rng.uniform(1e-6, 1e-4)
            sights.append((one, w))
    of_wall = np.array([w for _, w in sights])
    return SeenOnWalls.of(views, np.concatenate([one for one, _ in sights]), walls[of_wall], of_wall)


@pytest.mark.parametrize("chained", [True, False])
def test_the_covariance_is_that_of_least_squares_with_all_that_is_common(chained: bool) -> None:
    """Errors of walls and of views as correlations of the residuals, in one dense matrix."""
    rng = np.random.default_rng(8)
    steps, covariances = chain(rng, 3)
    places = placed(steps, np.zeros((3, 3)))
    views = [View(scan_of(ENDS))]
    views += [View(scan_of(ENDS), RigidTransform(*places[k]), covariances[k], k if chained else None) for k in range(3)]
    together = assemble(views).views
    assert together is not None
    shown, variance = on_walls(rng, together), 0.02**2
    estimated = shown.estimate(pose(), variance, Deadline())
    assert same_pose(estimated.pose, pose(), 1e-9, 1e-9)
    rows, by_pose, by_views, noise = [], [], [], []
    for one, wall in zip(shown.seen, shown.walls, strict=True):
        n, c = np.array([-wall["dy"], wall["dx"]]), np.array([one["centroid_x"], one["centroid_y"]])
        at = together.poses[one["sensor"]]
        lever = n @ [-c[1], c[0]]
        by_pose.append([n[0], n[1], lever])
        own = np.zeros(3 * len(together))
        own[3 * one["sensor"] : 3 * one["sensor"] + 3] = [n[0], n[1], lever - n @ [-at.y, at.x]]
        by_views.append(own)
        noise.append(one["variance"] + ROUGH_FRACTION * variance)
        turn = np.zeros(3 * len(together))
        turn[3 * one["sensor"] + 2] = 1.0
        rows.append((turn, noise[-1] / one["spread"]))
    jacobian = np.vstack([by_pose, np.tile([0.0, 0.0, 1.0], (len(rows), 1))])
    of_views = np.vstack([by_views, [turn for turn, _ in rows]])
    together_covariance = np.diag([*noise, *(angle for _, angle in rows)]) + of_views @ together.covariance @ of_views.T
    same = shown.number[:, None] == shown.number[None]
    together_covariance[: len(noise), : len(noise)] += variance * same
    information = jacobian.T @ np.linalg.solve(together_covariance, jacobian) + np.diag([SPRING, SPRING, 0.0])
    np.testing.assert_allclose(estimated.covariance, np.linalg.inv(information), rtol=1e-6)


def test_what_is_not_known_of_a_view_is_not_known_of_its_lines() -> None:
    """By the offset at the middle of their points, were the view elsewhere, and by the angle."""
    rng = np.random.default_rng(1)
    root = rng.normal(size=(3, 3)) * 0.02
    scan = assemble([View(scan_of(ENDS)), View(scan_of(ENDS), pose(1.5, -0.8, 0.3), root @ root.T)])
    assert scan.views is not None
    at, covariance = scan.views.poses[1], scan.views.covariance[3:, 3:]
    assert np.linalg.eigvalsh(covariance).min() > 0.0
    _, parts, of_view = parts_of(scan.measured, scan.views)
    assert set(of_view.tolist()) == {0, 1}
    step = 1e-6
    for part, view in zip(parts, of_view.tolist(), strict=True):
        seen_from, normal = np.array([at.x, at.y]), np.array([-part["dy"], part["dx"]])
        middle = np.array([part["centroid_x"], part["centroid_y"]])
        turned = RigidTransform(0.0, 0.0, step).apply(middle - seen_from) + seen_from
        gradient = np.array([*normal, normal @ (turned - middle) / step])
        offset, angle = (gradient @ covariance @ gradient, covariance[2, 2]) if view else (0.0, 0.0)
        assert part["common_offset"] == pytest.approx(offset, rel=1e-4)
        assert part["common_angle"] == pytest.approx(angle)


def test_walls_are_as_far_off_as_one_view_shows_them_to_be() -> None:
    """From views that are nearly exact, each of which sees walls of its own."""
    off = np.vstack([ROOM[:3] + np.array([0.0, 0.05, 0.0, 0.05]), ROOM[3:]])
    ends = seen(off, INSIDE, noise=0.005, seed=3)[0]
    exact = [View(scan_of(ends[:4])), View(scan_of(ends[4:]))]
    nearly = [exact[0], replace(exact[1], covariance=1e-12 * np.eye(3))]
    one, other = (search_and_rank(context_of(INDEX, assemble(views))).answer for views in (exact, nearly))
    assert one is not None
    assert other is not None
    assert one.estimated.views is None
    assert other.estimated.views is not None
    assert one.estimated.wall_sigma > 0.021
    assert other.estimated.wall_sigma == pytest.approx(one.estimated.wall_sigma, rel=1e-3)


def test_views_are_laid_on_one_another_where_their_walls_are_one() -> None:
    true = pose(-1.0, 0.3, 0.2)
    off = pose(-0.95, 0.24, 0.23)
    scan = assemble([view_at(pose()), view_at(off, true, np.diag([0.05**2, 0.05**2, 0.03**2]))])
    found = aligned(scan, Deadline()).views
    assert found is not None
    assert same_pose(found.poses[1], true, 0.02, 0.005)
    assert np.sqrt(np.diag(found.covariance)[3:5]).max() < 0.02
    exact = assemble([view_at(pose()), view_at(true)])
    assert aligned(exact, Deadline()) is exact


@pytest.mark.parametrize(("walls", "moves"), [([1.0], True), ([1.0, 1.05], True), ([1.0, 1.2], False)])
def test_a_line_that_may_be_either_of_two_walls_moves_no_view(walls: list[float], moves: bool) -> None:
    """Two faces of one thin wall count as one."""
    first = View(scan_of([[0.0, y, 4.0, y] for y in walls]))
    second = View(scan_of([[0.5, 1.1, 3.5, 1.1]]), pose(), np.diag([0.1**2, 0.1**2, 1e-6]))
    found = aligned(assemble([first, second]), Deadline()).views
    assert found is not None
    assert (abs(found.poses[1].y) > 0.02) is moves


def test_the_errors_of_views_are_found_beside_the_pose() -> None:
    """And where the scan is moved to them, its segments lie on the walls."""
    true, off = pose(-1.0, 0.3, 0.2), pose(-0.96, 0.25, 0.23)
    scan = assemble([view_at(pose()), view_at(off, true, np.diag([0.04**2, 0.04**2, 0.03**2]))])
    result = answer_of(INDEX, scan)
    assert result.status is Status.OK
    assert same_pose(pose_in(result), INSIDE, 0.02, 0.004)
    assert max(abs(pair.offset) for pair in result.correspondences) < 0.03
    answer = search_and_rank(context_of(INDEX, scan)).answer
    assert answer is not None
    assert answer.estimated.views is not None
    views = corrected(aligned(scan, Deadline()), answer.estimated.views.found, answer.estimated.views.spread).views
    assert views is not None
    assert same_pose(views.poses[1], true, 0.02, 0.005)


def test_views_scale_and_mirror_with_their_scan() -> None:
    scan = assemble([view_at(pose()), view_at(pose(1.0, 0.5, 0.3), covariance=STEP)])
    for changed, back in ((mirrored(scan), mirrored), (scaled(scan, 2.0), lambda one: scaled(one, 0.5))):
        again = back(changed)
        assert again.views is not None
        assert scan.views is not None
        np.testing.assert_allclose(again.views.covariance, scan.views.covariance, atol=1e-15)
        np.testing.assert_allclose(again.views.viewpoints, scan.views.viewpoints)
        np.testing.assert_allclose(again.measured.segments.endpoints, scan.measured.segments.endpoints)


def test_beams_count_where_every_view_has_them() -> None:
    ends = seen(ROOM, INSIDE)[0]
    with_beams = View(scan_of(ends, viewpoint=(0.0, 0.0), beams=beams_of(INDEX, INSIDE)))
    assert assemble([with_beams, replace(with_beams, pose=pose(0.1))]).beams is not None
    assert assemble([with_beams, View(scan_of(ends))]).beams is None


def test_a_drive_whose_last_view_does_not_fit_is_not_gone_by() -> None:
    """Its other views may fix where these were; the frame of the scan hangs on them by odometry alone."""
    places = [pose(), pose(-0.4, 0.2, 0.1), pose(-0.8, 0.1, 0.2), pose(-0.5, -0.4, 0.3)]

    def look(at: RigidTransform, turned: float) -> Scan:
        beams, ends = beams_of(INDEX, INSIDE.compose(at)), seen(ROOM, INSIDE.compose(at), noise=0.005, seed=5)[0]
        turn = pose(theta=turned)
        ends = turn.apply(ends.reshape(-1, 2, 2)).reshape(-1, 4)
        return scan_of(ends, viewpoint=(0.0, 0.0), beams=replace(beams, angles=beams.angles + turned))

    def drive(turned: float) -> Scan:
        step = np.diag([0.02**2, 0.02**2, 0.005**2])
        views = [View(look(at, turned if k == 0 else 0.0), at, step if k else None) for k, at in enumerate(places)]
        return assemble(views)

    def shown(turned: float) -> float:
        answer = search_and_rank(context_of(INDEX, drive(turned))).answer
        assert answer is not None
        return answer.beams.in_step

    assert shown(0.0) == pytest.approx(1.0, abs=0.05)
    assert shown(0.12) < LEAST_IN_STEP
    context = context_of(INDEX, drive(0.0))
    explained = search_and_rank(context)
    assert judge(context, explained).usable
    answer = explained.answer
    assert answer is not None
    slipped = replace(explained, answer=replace(answer, beams=replace(answer.beams, in_step=LEAST_IN_STEP - 0.01)))
    verdict = judge(context, slipped)
    assert (verdict.status, [one.code for one in verdict.reasons][:1]) == (Status.AMBIGUOUS, ["map_mismatch"])


@pytest.mark.parametrize(("covariance", "longest", "together"), [(STEP, 1.0, 0.52), (None, 1.5, 1.5625)])
def test_what_is_on_no_wall_counts_by_view_of_a_drive(
    covariance: Floats | None, longest: float, together: float
) -> None:
    """Each view shows a thing of its own, 0.5, 1 and 1.5 m long; exact views are one scan, with all three.

    Of these lengths 0, 1/4 and 7/8 count as that of walls.
    """
    views = []
    for k, length in enumerate((0.5, 1.0, 1.5)):
        at = pose(0.2 * k, 0.0, 0.1 * k)
        ends = seen(ROOM, INSIDE.compose(at), noise=0.005, seed=5)[0]
        thing = at.inverse().apply(np.array([[-1.0 - k, 1.0], [-1.0 - k, 1.0 + length]])).reshape(1, 4)
        scan = scan_of(np.vstack([ends, thing]), viewpoint=(0.0, 0.0))
        views.append(View(scan, at, covariance if k else None, k - 1 if k else None))
    context = context_of(INDEX, assemble(views))
    answer = search_and_rank(context).answer
    assert answer is not None
    features = features_of(context, answer)
    assert features.longest_unmatched == pytest.approx(longest, abs=0.01)
    assert features.root_unmatched_walls**2 == pytest.approx(together, abs=0.02)
