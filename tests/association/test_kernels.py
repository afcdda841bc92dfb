"""Every kernel does what its slow twin does."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from association import AssociationOptions, MapIndex
from association import _accept_kernels as accepting
from association import _agreement_kernels as agreeing
from association import _chance_kernels as chance
from association import _keeping_kernels as keeping
from association import _match_kernels as match
from association import _plan_kernels as plan
from association import _scan_kernels as scanning
from association import _search_kernels as search
from association._sight_kernels import distinct, first_hit
from association.candidates import _sampled_inliers
from association.scan_rows import gates, scan_rows
from association.significance import EXPONENTS
from registration import MeasuredSegments, RigidTransform, Segments

from . import reference
from .scenes import maze, scan_of, seen

SEEDS = st.integers(0, 2**31 - 1)
INDEX = MapIndex.build(Segments.from_array(maze(1)))
GRID = (INDEX.grid.starts, INDEX.grid.items, INDEX.grid.shape)
SECTORS = (INDEX.sectors.starts, INDEX.sectors.items, INDEX.sectors.shape)
GATES = gates(AssociationOptions())


def drawn(seed, radius=10.0, **options):
    """Return scan rows and their pose in the index frame."""
    rng = np.random.default_rng(seed)
    at = RigidTransform(*rng.uniform(8.0, 22.0, 2), rng.uniform(-3.0, 3.0))
    endpoints, _ = seen(maze(1), at, noise=0.02, cut=0.5, clutter=5, seed=seed, radius=radius, **options)
    rows = scan_rows(scan_of(endpoints), 0.0).rows
    return rng, rows, np.array([at.theta, at.x - INDEX.origin[0], at.y - INDEX.origin[1]])


@given(SEEDS)
@settings(max_examples=200, deadline=None)
def test_first_hit(seed):
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-25.0, 25.0, 2)
    turn = rng.choice([rng.uniform(-math.pi, math.pi), 0.0, math.pi / 2])
    limit = rng.choice([3.0, 60.0])
    ray = (x, y, math.cos(turn), math.sin(turn), limit)
    distance, wall = first_hit(*ray, INDEX.walls.rows, *GRID)
    expected, by = reference.first_hit(*ray, INDEX.walls.rows)
    assert distance == pytest.approx(expected, abs=1e-9)
    assert wall == by


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_match_scan(seed):
    rng, rows, pose = drawn(seed)
    pose = pose + rng.normal(size=3) * [0.01, 0.05, 0.05]
    root = rng.normal(size=(3, 3)) * [[0.05], [0.05], [0.01]]
    covariance, matches = root @ root.T, np.empty((len(rows), 5))

    def got(threshold):
        args = (rows, pose, covariance, INDEX.walls.rows, *GRID, GATES, threshold, matches)
        return match.match_scan(*args)

    expected, total = reference.match_scan(rows, pose, covariance, INDEX.walls.rows, GATES)
    assert got(0.0) == pytest.approx(total)
    np.testing.assert_array_equal(matches[:, 0], [e[0] for e in expected])
    found = matches[:, 0] >= 0
    assert found.any()
    np.testing.assert_allclose(matches[found, 1:4], np.array([e[1:] for e in expected])[found], atol=1e-9)
    assert got(total - 1e-6) == pytest.approx(total)
    assert got(total + 1e-6) == -1.0


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_may_score_bounds_the_score(seed):
    """What the raster says is out of reach no matching reaches, and it says so of some wrong poses."""
    rng, rows, pose = drawn(seed)
    far = pose + rng.normal(size=3) * [0.3, 3.0, 3.0]
    root = rng.normal(size=(3, 3)) * [[0.05], [0.05], [0.01]]
    covariance, matches, spreads = root @ root.T, np.empty((len(rows), 5)), np.empty(len(rows))
    match.angle_spreads(rows, covariance[2, 2], GATES, spreads)
    for at in (pose, far):
        total = match.match_scan(rows, at, covariance, INDEX.walls.rows, *GRID, GATES, 0.0, matches)
        assert match.may_score(rows, at, spreads, *INDEX.raster, total - 1e-9)
    away = np.array([0.0, 1e3, 0.0])
    assert not match.may_score(rows, pose + away, spreads, *INDEX.raster, 1e-9)


@given(SEEDS)
@settings(max_examples=25, deadline=None)
def test_agreement(seed):
    rng, rows, pose = drawn(seed)
    viewpoint = rng.uniform(-0.3, 0.3, 2)
    for at in (pose, pose + rng.normal(size=3) * [0.3, 3.0, 3.0]):
        got = agreeing.agreement(rows, *viewpoint, *at, INDEX.walls.rows, *GRID)
        assert got == pytest.approx(reference.agreement(rows, viewpoint, at, INDEX.walls.rows))


def test_agreement_of_the_true_pose_is_whole_and_of_half_a_turn_is_not():
    at = RigidTransform(14.0, 15.0, 0.4)
    rows = scan_rows(scan_of(seen(maze(1), at, radius=12.0)[0]), 0.0).rows
    place = at.x - INDEX.origin[0], at.y - INDEX.origin[1]
    here = agreeing.agreement(rows, 0.0, 0.0, at.theta, *place, INDEX.walls.rows, *GRID)
    turned = agreeing.agreement(rows, 0.0, 0.0, at.theta + math.pi, *place, INDEX.walls.rows, *GRID)
    assert here > 0.9
    assert turned < 0.6


def test_a_long_segment_bridges_a_doorway():
    """It lies on the walls on both sides; the gap counts against it, and a wider one is none that it bridges."""
    for gap, overlap in ((1.0, 4.0 / 6.0), (2.0, 0.5)):
        walls = [[0.0, 0.0, 3.0, 0.0], [3.0 + gap, 0.0, 9.0, 0.0], [9.0, 5.0, 0.0, 5.0]]
        index = MapIndex.build(Segments.from_array(walls))
        prepared = scan_rows(scan_of(np.array([[0.0, 0.0, 6.0, 0.0]])), 0.0)
        pose = np.array([0.0, *-index.origin])
        matches = np.empty((1, 5))
        match.match_scan(
            prepared.rows, pose, np.zeros((3, 3)), index.walls.rows, index.grid.starts, index.grid.items,
            index.grid.shape, GATES, 0.0, matches,
        )  # fmt: skip
        assert matches[0, 3] == pytest.approx(overlap)


def test_a_pose_over_a_doorway_may_score():
    """The raster has the direction of a run also where its walls are farther away than they are listed."""
    prepared = scan_rows(scan_of(np.array([[0.0, 0.0, 6.0, 0.0]])), 0.0)
    spreads, matches = np.empty(1), np.empty((1, 5))
    match.angle_spreads(prepared.rows, 0.0, GATES, spreads)
    for jamb in np.linspace(3.0, 3.5, 11):
        walls = [[0.0, 0.0, jamb, 0.0], [jamb + 1.45, 0.0, 9.0, 0.0], [9.0, 5.0, 0.0, 5.0]]
        index = MapIndex.build(Segments.from_array(walls))
        for slide in np.linspace(-3.0, 6.0, 46):
            pose = np.array([0.0, slide - index.origin[0], -index.origin[1]])
            total = match.match_scan(
                prepared.rows, pose, np.zeros((3, 3)), index.walls.rows, index.grid.starts, index.grid.items,
                index.grid.shape, GATES, 0.0, matches,
            )  # fmt: skip
            assert match.may_score(prepared.rows, pose, spreads, *index.raster, total - 1e-9), (jamb, slide)


def test_turning_holds_the_pin():
    """Of a pose that turns about a point the covariance of that point's place is 0."""
    covariance = np.empty((3, 3))
    match.turning(0.01, 2.0, -3.0, covariance)
    at_pin = np.array([[1.0, 0.0, 3.0], [0.0, 1.0, 2.0]])  # derivative of R p + t by (x, y, theta), R p = (2, -3)
    np.testing.assert_allclose(at_pin @ covariance @ at_pin.T, 0.0, atol=1e-15)
    assert covariance[2, 2] == 0.01


def test_refine_finds_the_pose_again():
    """From 10 cm and 1 degree off, the consensus set grows back and holds nothing but true pairs."""
    at = RigidTransform(14.0, 15.0, 0.4)
    endpoints, truth = seen(maze(1), at, clutter=4, radius=12.0)
    prepared = scan_rows(scan_of(endpoints), 0.0)
    pose = np.array([at.theta + 0.017, at.x - INDEX.origin[0] + 0.07, at.y - INDEX.origin[1] - 0.07])
    covariance, matches = np.diag([0.01, 0.01, 4e-4]), np.empty((len(truth), 5))
    match.refine(
        prepared.rows, pose, covariance, INDEX.walls.rows, *GRID, GATES, matches, np.empty(18), np.empty((3, 3)), 4
    )
    np.testing.assert_allclose(pose, [at.theta, at.x - INDEX.origin[0], at.y - INDEX.origin[1]], atol=1e-9)
    expected = np.where(truth >= 0, INDEX.wall_of_piece[np.maximum(truth, 0)], -1)[prepared.order]
    np.testing.assert_array_equal(matches[expected >= 0, 0], expected[expected >= 0])


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_a_base_is_swept_whole(seed):
    """Every pose that going through all pairs of walls gives is proposed, and no other."""
    _, rows, _ = drawn(seed, radius=7.0)
    long = [i for i in range(len(rows)) if rows[i, 4] > 1.0]
    pairs = [(i, j) for i in long for j in long if i < j and abs(math.sin(rows[i, 5] - rows[j, 5])) > 0.3]
    if not pairs:
        return
    a, b = pairs[seed % len(pairs)]
    tolerance = min(GATES[4], max(GATES[3], GATES[0] * math.sqrt(rows[a, 10] + rows[b, 10])))

    def slack(length):
        return search.BASE_SLACK + search.BASE_SLACK_SHARE * length

    runs = INDEX.runs
    expected = reference.placements(rows, a, b, runs.rows, slack, tolerance)
    rules = np.array([0.65, 0.3, 0.1, 0.9])
    for budget in (10**9, 1):
        progress, resume = np.zeros(5, dtype=np.int64), np.array([-np.inf])
        calls = 0
        while progress[0] == 0:
            calls += 1
            search.search_base(
                rows, a, b, runs.rows, runs.bin_starts, INDEX.walls.rows, *GRID, *INDEX.raster, *SECTORS, GATES, rules,
                np.zeros(10), np.zeros((64, 5)), np.zeros(1, dtype=np.int64), np.array([1e9, 0.0, 0.0]), progress,
                resume, budget,
            )  # fmt: skip
        assert progress[2] == len(expected)
        assert (calls == 1) == (budget > 1)


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_distinct(seed):
    rng = np.random.default_rng(seed)
    poses = rng.choice(rng.uniform(-4.0, 4.0, (12, 3)), 40) + rng.normal(size=(40, 3)) * 0.2
    roots = rng.normal(size=(40, 3, 3)) * rng.choice([0.02, 0.3], (40, 1, 1))
    covariances, order = roots @ roots.transpose(0, 2, 1) + 1e-4 * np.eye(3), rng.permutation(40)
    rules = np.array([0.3, 0.1, 12.8])
    for most in (5, 40):
        got = distinct(poses, covariances, order, most, rules)
        assert got.tolist() == reference.distinct(poses, covariances, order, most, rules)


def test_invert3():
    rng = np.random.default_rng(0)
    root = rng.normal(size=(3, 3))
    matrix, out = root @ root.T, np.empty((3, 3))
    assert match.invert3(matrix, out)
    np.testing.assert_allclose(out, np.linalg.inv(matrix))
    assert not match.invert3(np.diag([1.0, 1.0, 0.0]), out)


def test_bound_is_never_below_what_can_have_been_missed():
    """Brute force over all consensus sets that contain none of the bases."""
    rng = np.random.default_rng(4)
    gains = rng.uniform(1.0, 10.0, 9)
    residual, bound = gains.copy(), np.array([gains.sum()])
    tried = []
    for _ in range(12):
        a, b = rng.choice(9, 2, replace=False)
        plan.cover(residual, bound, a, b)
        tried.append((1 << int(a)) | (1 << int(b)))
        free = [s for s in range(512) if not any(s & t == t for t in tried)]
        missed = max(sum(gains[i] for i in range(9) if s >> i & 1) for s in free)
        assert bound[0] >= missed - 1e-9


def test_strike_counts_the_samples_that_are_left():
    inliers = _sampled_inliers(6)
    missing = np.full((6, inliers.shape[-1]), ~np.uint64(0))
    bits = np.unpackbits(inliers.view(np.uint8), axis=-1).astype(bool)
    assert (bits.sum(axis=1) == np.arange(1, 7)[:, None]).all(), "every sample of level m has m + 1 segments"
    alive = np.ones((6, bits.shape[-1]), dtype=bool)
    for a, b in ((0, 1), (2, 3), (1, 4)):
        left = plan.strike(missing, inliers, a, b, 3)
        alive &= ~(bits[:, a] & bits[:, b])
        assert left == pytest.approx(alive[2].mean())
    # Of the 20 sets of three of six, those without a base: by counting.
    bases = [{0, 1}, {2, 3}, {1, 4}]
    sets = list(itertools.combinations(range(6), 3))
    expected = np.mean([not any(base <= set(s) for base in bases) for s in sets])
    assert left == pytest.approx(expected, abs=0.02)


def test_fewest_segments():
    gains = np.array([5.0, 3.0, 2.0, 1.0])
    assert [plan.fewest_segments(gains, 0.0, x) for x in (4.0, 8.0, 8.5, 10.5, 99.0)] == [2, 2, 3, 4, 4]
    assert plan.fewest_segments(gains, 5.0, 9.0) == 2


def test_prior_value():
    soft = np.array([1.0, 2.0, 3.0, 3.1, 4.0, 0.0, 0.0, 1.0, 0.0, 100.0])
    assert keeping.prior_value(soft, 3.1, 2.0, 3.0) == 0.0
    assert keeping.prior_value(soft, -3.1, 2.5, 3.0) == pytest.approx(-0.5 * (1.0 + 100.0 * (math.tau - 6.2) ** 2))
    assert keeping.prior_value(soft, 3.1, 200.0, 3.0) == keeping.SOFT_FLOOR
    hard = np.array([2.0, 2.0, 3.0, 3.1, 0.5, 0.2, 0, 0, 0, 0])
    assert keeping.prior_value(hard, -3.1, 2.4, 3.2) == keeping.INSIDE
    assert keeping.prior_value(hard, 3.1, 2.4, 3.4) == 0.0
    assert keeping.prior_value(hard, 2.8, 2.0, 3.0) == 0.0


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_fill_rows(seed):
    rng = np.random.default_rng(seed)
    segments = Segments.from_array(maze(seed, 9)[[0, 1, 2, 3, 4, 5, 6, 7, 8, 2]])
    measured = MeasuredSegments.from_segments(
        segments,
        rng.uniform(0.0, 0.1, 10),
        rng.uniform(2.0, 50.0, 10),
        (segments.midpoints + 0.1, rng.random(10) * 1e-5),
    )
    arrays = (
        segments.directions, segments.midpoints, segments.lengths, measured.centroids, measured.spreads, measured.sigma,
        measured.points,
    )  # fmt: skip
    floors = rng.choice([0.0, 1e-10, 1e-3, 1.0], 4)
    order, expected = reference.scan_rows(*arrays, floors)
    np.testing.assert_allclose(scanning.fill_rows(*arrays, np.array(order), *floors), expected, rtol=1e-12)
    prepared = scan_rows(scan_of(segments.endpoints), 0.0)
    np.testing.assert_array_equal(prepared.order, order)


@given(SEEDS, st.floats(0.0, 400.0))
@settings(max_examples=30, deadline=None)
def test_chance_matches_and_log_tail(seed, score):
    rng, rows, _ = drawn(seed)
    if not len(rows):
        return
    agreeing, area = rng.uniform(0.1, 1.0), 10.0 ** rng.uniform(0.0, 5.0)
    expected = reference.chance_matches(rows, INDEX.walls.longest, agreeing, area, GATES)
    chances = chance.chance_matches(rows, *INDEX.sorted_lengths, agreeing, area, GATES)
    np.testing.assert_allclose(chances, expected, rtol=1e-12)
    least = chance.log_tail(rows, chances, score, EXPONENTS)
    assert least == pytest.approx(reference.log_tail(rows, expected, score, EXPONENTS), rel=1e-9, abs=1e-12)


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_accept_matches(seed):
    """On a map whose walls were drawn in pieces, some of which overlap or come twice."""
    rng = np.random.default_rng(seed)
    index, pieces_of_wall = in_pieces(rng)
    at = RigidTransform(*rng.uniform(8.0, 22.0, 2), rng.uniform(-3.0, 3.0))
    endpoints, _ = seen(maze(1), at, noise=0.02, cut=0.5, clutter=3, seed=seed, radius=12.0)
    prepared = scan_rows(scan_of(endpoints), 0.0)
    pose = np.array([at.theta, at.x - index.origin[0], at.y - index.origin[1]])
    matches, grid = np.empty((len(endpoints), 5)), (index.grid.starts, index.grid.items, index.grid.shape)
    match.match_scan(prepared.rows, pose, np.diag([1e-4, 1e-4, 1e-6]), index.walls.rows, *grid, GATES, 0.0, matches)
    pairs, overlaps, rivals, starts = accepting.accept_matches(
        matches, prepared.order, endpoints, *pose, index.walls.rows, index.pieces, index.piece_starts,
        index.endpoints,
    )  # fmt: skip
    local = RigidTransform(pose[1], pose[2], pose[0])
    expected = reference.accept_matches(
        matches, prepared.order, endpoints, local, index.walls.rows, pieces_of_wall, index.endpoints
    )
    assert len(expected) > 0
    assert pairs.tolist() == [[i, piece] for i, piece, _, _ in expected]
    np.testing.assert_allclose(overlaps, [overlap for *_, overlap, _ in expected], atol=1e-4)
    got = [rivals[starts[k] : starts[k + 1]].tolist() for k in range(len(pairs))]
    assert got == [others for *_, others in expected]


def in_pieces(rng):
    """Return the maze with walls cut up, pieces overlapping and some coming twice, and the pieces of every wall."""
    pieces = []
    for wall in maze(1):
        a, d = wall[:2], wall[2:] - wall[:2]
        cuts = np.sort(rng.choice(19, rng.integers(1, 14), replace=False) + 1.0).tolist()
        for begin, end in itertools.pairwise([0.0, *cuts, 20.0]):
            pieces.append(np.concatenate([a + max(0.0, begin - 0.8) / 20.0 * d, a + end / 20.0 * d]))
    index = MapIndex.build(Segments.from_array([*pieces, *pieces[::3]]))
    places = range(len(index.walls.rows))
    return index, [index.pieces[index.piece_starts[w] : index.piece_starts[w + 1]].tolist() for w in places]


def test_union_length():
    lows, highs = np.array([3.0, 0.0, 0.5, 3.0, 9.0]), np.array([4.0, 2.0, 1.0, 5.0, 9.5])
    assert [accepting.union_length(lows, highs, count) for count in range(6)] == [0.0, 1.0, 3.0, 3.0, 4.0, 4.5]


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_missing_pieces(seed):
    rng = np.random.default_rng(seed)
    index, pieces_of_wall = in_pieces(rng)
    at = RigidTransform(*rng.uniform(8.0, 22.0, 2), rng.uniform(-3.0, 3.0))
    endpoints, _ = seen(maze(1), at, seed=seed, radius=8.0)
    rows = scan_rows(scan_of(endpoints), 0.0).rows
    pose = RigidTransform(at.x - index.origin[0], at.y - index.origin[1], at.theta)
    matches = np.full((len(rows), 5), -1.0)
    matches[:, 0] = np.where(rng.random(len(rows)) < 0.8, rng.integers(0, len(index.walls.rows), len(rows)), -1)
    viewpoint = rng.normal(size=2)
    got = accepting.missing_pieces(
        rows, matches, *viewpoint, pose.theta, pose.x, pose.y, index.walls.rows, index.grid.starts, index.grid.items,
        index.grid.shape, index.pieces, index.piece_starts,
    )  # fmt: skip
    expected = reference.missing_pieces(rows, matches, viewpoint, pose, index.walls.rows, pieces_of_wall)
    assert sorted(got.tolist()) == expected
