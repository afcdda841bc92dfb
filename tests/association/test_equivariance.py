"""An answer does not depend on frames, on order, or on how walls are cut into segments."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import Phase, example, given, settings
from hypothesis import strategies as st

from association import AssociationResult, HardPrior, Prior, Scan, SoftPrior, View, assemble
from registration import MeasuredSegments, RigidTransform, Segments

from .scenes import (
    INSIDE,
    LOBBY,
    ROOM,
    Floats,
    answer_of,
    as_json,
    carried,
    drawn,
    drawn_room,
    ends_of,
    equal_rooms,
    in_frame,
    index_of,
    known,
    mounted,
    pose,
    ranges,
    same_pose,
    scan_of,
    seen,
)

SEEDS = st.integers(0, 10**6)
ANGLES = st.floats(-math.pi, math.pi)
FAR = st.floats(-1e5, 1e5)  # m
LEVERS = st.sampled_from([0.1, 2.0, 20.0, 60.0])  # m
# A smaller seed is no simpler example.
FEW = settings(max_examples=25, deadline=None, phases=[Phase.explicit, Phase.generate])


def derivative(by: RigidTransform, at: RigidTransform) -> Floats:
    """Return that of ``by . at`` by the additive (x, y, theta) of `by`."""
    lever = RigidTransform(0.0, 0.0, by.theta).apply(np.array([at.x, at.y]))
    return np.array([[1.0, 0.0, -lever[1]], [0.0, 1.0, lever[0]], [0.0, 0.0, 1.0]])


def turn_of(by: RigidTransform) -> Floats:
    c, s = math.cos(by.theta), math.sin(by.theta)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def assert_same_verdict(one: AssociationResult, other: AssociationResult, probability: float = 1e-6) -> None:
    assert (other.status, other.usable) == (one.status, one.usable)
    assert (other.probability is None) == (one.probability is None)
    if one.probability is not None and other.probability is not None:
        assert other.probability == pytest.approx(one.probability, abs=probability)


def assert_covariances(one: Floats, other: Floats, fraction: float) -> None:
    """Compare the variances along all directions."""
    ratios = np.linalg.eigvals(np.linalg.solve(one, other)).real
    np.testing.assert_allclose(ratios, 1.0, atol=fraction)


def leads(result: AssociationResult) -> bool:
    """Return whether the best pose is not one of several that are equally good, of which rounding chooses."""
    margin = None if result.diagnostics is None else result.diagnostics.margin
    return result.pose is not None and (margin is None or margin > 1e-5)


@given(SEEDS, FAR, FAR, ANGLES)
@FEW
def test_a_rigid_motion_of_the_map_moves_the_answer(seed: int, x: float, y: float, theta: float) -> None:
    walls, scan = drawn(seed)
    by = RigidTransform(x, y, theta)
    here, there = answer_of(index_of(walls), scan), answer_of(index_of(carried(walls, by)), scan)
    assert_same_verdict(here, there)
    if not leads(here):
        return
    assert same_pose(by.compose(known(here.pose)), there.pose, 1e-6, 1e-6)
    if here.covariance is not None:
        turned = turn_of(by) @ here.covariance @ turn_of(by).T
        assert_covariances(turned, known(there.covariance), 1e-3)
    if here.unobservable is not None:
        assert abs((turn_of(by)[:2, :2] @ here.unobservable) @ known(there.unobservable)) == pytest.approx(
            1.0, abs=1e-6
        )


def of_ranges(seed: int) -> tuple[Floats, Scan]:
    """Draw with biased ranges, a sensor that rotates and a map with errors, too: each has a correction of its own."""
    walls, scan = drawn(12 * seed + seed % 4)
    assert scan.beams is not None
    return walls, scan


def of_segments(seed: int) -> tuple[Floats, Scan]:
    walls, ends = ends_of(seed)
    return walls, scan_of(ends, viewpoint=(0.0, 0.0))


@pytest.mark.parametrize(
    ("question", "moved"),
    [
        (of_ranges, in_frame),
        (of_ranges, mounted),
        (of_segments, in_frame),
        (of_segments, mounted),
    ],
)
@example(3, 20.0, 0.5, 1.0)
@example(1, 60.0, -2.5, -1.0)
@given(SEEDS, LEVERS, ANGLES, ANGLES)
@FEW
def test_where_the_scan_frame_begins_does_not_matter(
    question: Callable[[int], tuple[Floats, Scan]],
    moved: Callable[[Scan, RigidTransform], Scan],
    seed: int,
    lever: float,
    along: float,
    theta: float,
) -> None:
    """Compare a scan in the sensor's frame with the same data in a frame in which the sensor is at a mount."""
    walls, scan = question(seed)
    mount = RigidTransform(lever * math.cos(along), lever * math.sin(along), theta)
    index = index_of(walls)
    here, there = answer_of(index, scan), answer_of(index, moved(scan, mount))
    assert_same_verdict(here, there)
    if not leads(here):
        return
    assert same_pose(known(there.pose).compose(mount), here.pose, 1e-6, 1e-6)
    if there.covariance is not None:
        by = derivative(known(there.pose), mount)
        assert_covariances(known(here.covariance), by @ there.covariance @ by.T, 1e-3)
    assert [(one.scan, one.map) for one in here.correspondences] == [(o.scan, o.map) for o in there.correspondences]
    assert [one.code for one in here.reasons] == [one.code for one in there.reasons]
    assert [one.code for one in here.warnings] == [one.code for one in there.warnings]


@given(SEEDS)
@FEW
def test_the_order_of_segments_does_not_matter(seed: int) -> None:
    """Neither that of the scan nor that of the map."""
    walls, ends = ends_of(seed)
    rng = np.random.default_rng(seed)
    of_scan, of_map = rng.permutation(len(ends)), rng.permutation(len(walls))
    one = answer_of(index_of(walls), scan_of(ends))
    other = answer_of(index_of(walls[of_map]), scan_of(ends[of_scan]))
    assert_same_verdict(one, other)
    if leads(one):
        assert same_pose(one.pose, other.pose, 1e-6, 1e-7)
        pairs = {(int(of_scan[c.scan]), int(of_map[c.map])) for c in other.correspondences}
        assert pairs == {(c.scan, c.map) for c in one.correspondences}


def cut_up(rng: np.random.Generator, ends: Floats, most: int = 6) -> Floats:
    """Cut a segment into up to so many pieces."""
    cuts = np.unique([0.0, *rng.random(rng.integers(0, most)).round(3), 1.0])
    a, d = ends[:2], ends[2:] - ends[:2]
    return np.array([np.concatenate([a + s * d, a + t * d]) for s, t in itertools.pairwise(cuts.tolist())])


def assert_hardly_moved(one: AssociationResult, other: AssociationResult) -> None:
    """Compare answers to the same walls, cut in another way."""
    assert_same_verdict(one, other, 0.02)
    if leads(one):
        assert same_pose(one.pose, other.pose, 1e-3, 1e-3)


@given(SEEDS)
@FEW
def test_how_the_walls_of_a_map_are_cut_does_not_matter(seed: int) -> None:
    walls, scan = drawn(seed)
    rng = np.random.default_rng(seed)
    pieces = np.vstack([cut_up(rng, one) for one in walls])
    assert_hardly_moved(answer_of(index_of(walls), scan), answer_of(index_of(rng.permutation(pieces)), scan))


def with_cupboards(rng: np.random.Generator, room: Floats) -> Floats:
    """Return a room with shallow things along its walls, 4 to 15 cm deep: each has a face parallel to the wall."""
    faces = []
    for wall in room:
        length = float(np.hypot(*(wall[2:] - wall[:2])))
        if length > 1.2 and rng.random() < 0.6:
            d = (wall[2:] - wall[:2]) / length
            out = np.array([-d[1], d[0]]) * rng.uniform(0.04, 0.15)
            begin, width = wall[:2] + rng.uniform(0.1, 0.4) * length * d, rng.uniform(0.3, 0.5) * length * d
            corners = [begin, begin + out, begin + width + out, begin + width]
            faces += [np.concatenate(pair) for pair in itertools.pairwise(corners)]
    return np.vstack([room, *faces])


@pytest.mark.xfail(strict=True, reason="a cut moves the pose by up to 13 mm where a parallel wall is near")
@given(SEEDS, st.booleans())
@FEW
def test_how_walls_are_cut_does_not_matter_where_another_one_is_near(seed: int, on_map: bool) -> None:
    """Things along the walls are on the map, or are not."""
    rng = np.random.default_rng(seed)
    room, at = drawn_room(rng)
    truth = with_cupboards(rng, room)
    walls = truth if on_map else room
    pieces = rng.permutation(np.vstack([cut_up(rng, one) for one in walls]))
    scan = ranges(truth, at, seed)
    assert_hardly_moved(answer_of(index_of(walls), scan), answer_of(index_of(pieces), scan))


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 4])
def test_how_often_a_wall_is_drawn_does_not_matter(seed: int) -> None:
    walls, ends = ends_of(seed)
    scan = scan_of(ends)
    one = answer_of(index_of(walls), scan)
    rng = np.random.default_rng(seed)
    for copies in (np.vstack([walls, walls]), np.vstack([walls, *(cut_up(rng, each) for each in walls)])):
        assert_hardly_moved(one, answer_of(index_of(copies), scan))


def cut_evenly(rng: np.random.Generator, scan: Scan) -> Scan:
    """Cut segments of evenly spread points into equal pieces, with their parts of the points; some are sent twice."""
    whole, ends, sigma, points = scan.measured, [], [], []
    for each, s, n in zip(whole.segments.endpoints, whole.sigma, whole.point_counts, strict=True):
        count, again = int(rng.integers(1, max(2, min(5, int(n))))), int(rng.integers(1, 3))
        marks = [each[:2] + t * (each[2:] - each[:2]) for t in np.linspace(0.0, 1.0, count + 1)]
        ends += [np.concatenate(pair) for pair in itertools.pairwise(marks)] * again
        sigma += [s] * count * again
        points += [n / count] * count * again
    order = rng.permutation(len(ends))
    pieces = Segments.from_array(np.array(ends)[order])
    measured = MeasuredSegments.from_segments(pieces, np.array(sigma)[order], np.array(points)[order])
    return Scan(measured, scan.viewpoint)


def even(scan: Scan) -> Scan:
    """Return a scan whose points are spread evenly along each segment."""
    one = scan.measured
    return Scan(MeasuredSegments.from_segments(one.segments, one.sigma, one.point_counts), scan.viewpoint)


@given(SEEDS)
@FEW
def test_how_the_segments_of_a_scan_are_cut_does_not_matter(seed: int) -> None:
    walls, scan = drawn(seed)
    index, whole = index_of(walls), even(scan)
    assert_hardly_moved(answer_of(index, whole), answer_of(index, cut_evenly(np.random.default_rng(seed), whole)))


@given(SEEDS)
@FEW
def test_the_same_request_has_the_same_answer_to_the_bit(seed: int) -> None:
    """From an index that was used before and from a new one."""
    walls, scan = drawn(seed)
    used = index_of(walls)
    answers = [answer_of(index, scan, seed=seed, sampling="random") for index in (used, used, index_of(walls))]
    assert len({as_json(one) for one in answers}) == 1


def turned_about(rng: np.random.Generator, ends: Floats) -> Floats:
    """Exchange begin and end of some segments."""
    return np.where(rng.random(len(ends))[:, None] < 0.5, ends[:, [2, 3, 0, 1]], ends)


@pytest.mark.parametrize("stated_by", ["map", "option"])
@example(4)
@example(9)
@given(SEEDS)
@FEW
def test_without_directions_reversed_segments_change_nothing(stated_by: str, seed: int) -> None:
    """Of the scan and of the map; the covariance stays, too."""
    walls, ends = ends_of(seed)
    rng = np.random.default_rng(seed)

    def searched(on_map: Floats, in_scan: Floats) -> AssociationResult:
        """Search where the map itself, or only the option states that directions mean nothing."""
        index = index_of(on_map, oriented=stated_by == "option")
        return answer_of(index, scan_of(in_scan, 0.02, (0.0, 0.0)), oriented=False)

    one, other = searched(walls, ends), searched(turned_about(rng, walls), turned_about(rng, ends))
    assert_same_verdict(one, other)
    if leads(one):
        assert same_pose(one.pose, other.pose, 1e-6, 1e-6)
        if one.covariance is not None:
            assert_covariances(one.covariance, known(other.covariance), 1e-4)
        assert [(c.scan, c.map) for c in one.correspondences] == [(c.scan, c.map) for c in other.correspondences]


def test_a_reversed_copy_is_no_more_evidence_where_directions_mean_nothing() -> None:
    index = index_of(LOBBY, oriented=False)
    corner = seen(LOBBY, pose(3.0, 1.0, 0.4), noise=0.01, cut=0.6, seed=5)[0][:3]
    copies = np.vstack([corner, corner[:2, [2, 3, 0, 1]]])
    one, other = (answer_of(index, scan_of(ends, 0.01, (0.0, 0.0)), oriented=False) for ends in (corner, copies))
    assert_hardly_moved(one, other)
    assert len(other.correspondences) == len(one.correspondences) + 2


def test_a_reversed_segment_is_another_side_where_directions_mean_something() -> None:
    index = index_of(np.vstack([LOBBY, LOBBY[:2, [2, 3, 0, 1]]]))
    corner = np.array([[-3.0, -1.0, 4.5, -1.0], [4.5, -1.0, 4.5, 1.5]])
    both = np.vstack([corner, corner[:, [2, 3, 0, 1]]])
    one, other = (answer_of(index, scan_of(ends)) for ends in (corner, both))
    assert known(other.diagnostics).score > known(one.diagnostics).score + 5.0


def test_a_prior_moves_with_the_map() -> None:
    by, scan = RigidTransform(-3e4, 7e4, 2.0), scan_of(seen(ROOM, INSIDE, noise=0.01, seed=2)[0])
    rooms, second = equal_rooms(2), pose(INSIDE.x + 12.1, INSIDE.y, INSIDE.theta)
    there, spread = by.compose(second), np.diag([0.3, 0.1, 0.05])
    turned = turn_of(by) @ spread @ turn_of(by).T
    priors: list[tuple[Prior, Prior]] = [
        (HardPrior(second, 1.0, 0.5), HardPrior(there, 1.0, 0.5)),
        (SoftPrior(second, spread), SoftPrior(there, turned)),
    ]
    for here, moved in priors:
        one = answer_of(index_of(rooms), scan, here)
        other = answer_of(index_of(carried(rooms, by)), scan, moved)
        assert one.usable
        assert_same_verdict(one, other)
        assert same_pose(by.compose(known(one.pose)), other.pose, 1e-6, 1e-6)


def test_a_distorted_map_may_be_turned() -> None:
    """One that is stretched along an axis, and whose walls are off by 1 cm."""
    for k in range(8):
        rng = np.random.default_rng([17, k])
        room, at = drawn_room(rng)
        walls = np.asarray((room.reshape(-1, 2) @ np.diag([1.006, 1.0])).reshape(-1, 4))
        walls = walls + np.tile(rng.normal(0.0, 0.01, (len(room), 2)), 2)
        scan, plain = ranges(room, at, k), None
        for turn in (0.0, 0.5, 1.2, 2.0):
            by = pose(theta=turn)
            one = answer_of(index_of(carried(walls, by), 0.02), scan)
            plain = plain or one
            assert_same_verdict(plain, one)
            assert same_pose(by.compose(known(plain.pose)), one.pose, 1e-6, 1e-6)
            assert_covariances(turn_of(by) @ known(plain.covariance) @ turn_of(by).T, known(one.covariance), 1e-3)


def test_coordinates_far_from_the_origin_lose_no_accuracy() -> None:
    """UTM: 5,000 km from the origin."""
    shift = np.array([5e6, 4.2e6])
    ends = seen(ROOM, INSIDE, noise=0.01, seed=3)[0]
    near, far = (answer_of(index_of(walls), scan_of(ends)) for walls in (ROOM, ROOM + np.tile(shift, 2)))
    back = pose(known(far.pose).x - shift[0], known(far.pose).y - shift[1], known(far.pose).theta)
    assert same_pose(near.pose, back, 2e-8, 1e-8)
    np.testing.assert_allclose(known(near.covariance), known(far.covariance), rtol=1e-5, atol=1e-12)


@pytest.mark.parametrize("copies", [2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_a_view_that_is_sent_again_changes_nothing(seed: int, copies: int) -> None:
    """Its segments are seen once, and its lines of sight pass through walls once."""
    walls, ends = ends_of(seed)
    index, view = index_of(walls), View(scan_of(ends, viewpoint=(0.0, 0.0)))
    one, other = (answer_of(index, assemble([view] * count)) for count in (1, copies))
    assert_hardly_moved(one, other)
