"""All poses that a base allows are proposed, and no other, however often the search is interrupted."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import example, given, settings

from association import HardPrior
from association.layout import BASE, FOUND, POSED, PROGRESS, RULES, record
from association.search.kernels import proposing, sweeping, trying
from association.search.kernels.sliding import search_slides
from association.tables import Question
from association.tuning import AT_ONCE, ROUNDS, TESTS_HYPOTHESIS, TESTS_REFINED, TESTS_REJECTED
from registration import RigidTransform
from registration.layout import Records

from ...kernels.drawn import GATES, INDEX, MODEL, PLACE, SEEDS, SMALL, TABLES, Drawn, drawn, oblique, workspace_of
from ...kernels.plans import entries_of
from ...records import pose_of
from ...reference import proposing as twin
from ...reference.consensus import refine
from ...reference.geometry import moved
from ...reference.matching import gates_about, match_scan, reachable
from ...scenes import context_of, index_of, same_pose, scan_of

ALL = record(RULES, kept_share=0.0, distinct_distance=0.0, distinct_angle=0.0, rival_share=0.95)  # keep every pose


def base_of(d: Drawn, least: float = 1.0) -> tuple[int, int] | None:
    """Draw a base of two segments over a metre."""
    long = [i for i in range(len(d.scan)) if d.scan["length"][i] > least]
    angles = d.scan["angle"]
    pairs = [(i, j) for i, j in itertools.permutations(long, 2) if abs(math.sin(angles[i] - angles[j])) > 0.3]
    return pairs[int(d.rng.integers(len(pairs)))] if pairs else None


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_anchors(seed: int) -> None:
    rng = np.random.default_rng(seed)
    runs, out, length = oblique(rng).runs, np.zeros(60, np.int64), rng.uniform(0.3, 7.0)
    lengths = runs.rows["end"] - runs.rows["begin"]
    count = sweeping.anchors(length, lengths, out)
    assert out[:count].tolist() == np.nonzero(lengths >= length - 2.0 * twin.end_slack(length))[0].tolist()


@given(SEEDS)
@settings(max_examples=100, deadline=None)
def test_base_pose(seed: int) -> None:
    """The first tells more of the angle, or the second; at the ends of the walls, too."""
    d = drawn(seed)
    d.scan["angle_variance"] *= 10.0 ** d.rng.uniform(0.0, 2.0, len(d.scan))
    runs = oblique(d.rng).runs.rows
    a, b = d.scan[d.rng.choice(len(d.scan), 2, replace=False)]
    for wa, wb in itertools.permutations(runs[d.rng.choice(len(runs), 4, replace=False)], 2):
        if abs(wa["dx"] * wb["dy"] - wa["dy"] * wb["dx"]) < 0.1:
            continue
        at, inside = twin.base_pose(a, b, wa, wb)
        out = np.zeros(1, POSED)
        assert bool(proposing.base_pose(a, b, wa, wb, out[0])) is inside
        assert same_pose(pose_of(out[0]), at, 1e-9, 1e-9)
        assert (out["cosine"][0], out["sine"][0]) == pytest.approx((math.cos(at.theta), math.sin(at.theta)), abs=1e-12)


@pytest.mark.parametrize("angle", [0.0, -1e-9, 0.07, -0.2999, 0.3001, -1.0, 3.0])
def test_what_is_turned_a_little(angle: float) -> None:
    """By their series where that is exact, and as by the library beyond."""
    for heading in np.linspace(-4.0, 4.0, 9).tolist():
        turned = proposing.turn_a_little(math.cos(heading), math.sin(heading), angle)
        assert turned == pytest.approx((math.cos(heading + angle), math.sin(heading + angle)), abs=3e-15)


@pytest.mark.parametrize(("slide", "inside"), [(-0.01, False), (0.01, True), (2.99, True), (3.01, False)])
@pytest.mark.parametrize("second", [False, True])
def test_a_base_may_stick_out_of_its_walls_a_little(slide: float, inside: bool, second: bool) -> None:
    """A segment of 2 m by 40 cm; hence on a wall of 4.2 m there are 3 m for its midpoint."""
    rows = index_of([[0.0, 0.0, 4.2, 0.0], [20.0, -9.0, 20.0, 9.0]]).runs.rows
    wa, wb = rows[np.argsort(rows["end"] - rows["begin"])]
    d = drawn(0)
    a, b = d.scan[:1].copy(), d.scan[1:2].copy()
    for one, wall, along in ((a, wa, wa["begin"] + 0.6 + slide), (b, wb, 0.0)):
        one["dx"], one["dy"], one["angle"], one["length"] = wall["dx"], wall["dy"], wall["angle"], 2.0
        one["x"] = along * wall["dx"] - wall["offset"] * wall["dy"]
        one["y"] = along * wall["dy"] + wall["offset"] * wall["dx"]
    pair = (b[0], a[0], wb, wa) if second else (a[0], b[0], wa, wb)
    assert bool(proposing.base_pose(*pair, np.zeros(1, POSED)[0])) is inside


@dataclass(frozen=True)
class Found:
    """What came of proposals: poses (k,) of `FOUND`, progress (1,), and how often the search was called."""

    poses: Records
    progress: Records
    calls: int

    @property
    def proposed(self) -> int:
        return int(self.progress["hypotheses"][0])


def asked(d: Drawn, window: HardPrior | None = None) -> Question:
    """Ask for all poses there are; the window is one of the index frame."""
    if window is not None:
        window = HardPrior(moved(window.pose, [0.0, *INDEX.origin]), window.radius, window.angle)
    return context_of(INDEX, scan_of(d.endpoints), window).question(ALL)


def swept(question: Question, base: tuple[int, int], budget: int = 10**9, listed: int = -1) -> Found:
    """Go through a base; where it is `listed`, by the lists of crossings."""
    found, progress = np.zeros(20_000, FOUND), record(PROGRESS)
    chosen, work, calls = record(BASE, sliding=base[0], crossing=base[1], listed=listed), workspace_of(question.scan), 0
    while progress["bases"][0] == 0:
        calls += 1
        assert proposing.search_base(question, TABLES, chosen[0], found, progress[0], work, budget) > 0
    assert (progress["anchor"][0], progress["step"][0], progress["entry"][0]) == (0, 0, 0)
    return Found(found[: int(progress["count"][0])], progress, calls)


def slid(question: Question, sliding: int, spacing: float, budget: int = 10**9) -> Found:
    """Slide a segment."""
    found, progress = np.zeros(20_000, FOUND), record(PROGRESS)
    work, calls, done = workspace_of(question.scan), 0, False
    while not done:
        calls += 1
        done = search_slides(question, TABLES, sliding, found, progress, work, spacing, budget)
    return Found(found[: int(progress["count"][0])], progress, calls)


def assert_found(found: Found, scan: Records, proposals: list[twin.Proposal], window: HardPrior | None = None) -> None:
    """Compare with the proposals, refined, that score and lie in the window."""
    if window is not None:
        proposals = [one for one in proposals if twin.may_be_refined_into(window, one.pose)]
    refined = [refine(scan, one.pose, one.covariance, PLACE, GATES, MODEL, ROUNDS) for one in proposals]
    refined = [one for one in refined if one.score > 0.0 and (window is None or window.contains(one.pose))]
    expected = np.array([(one.score, one.pose.x, one.pose.y) for one in refined]).reshape(-1, 3)
    got = np.array(found.poses[["score", "x", "y"]].tolist()).reshape(-1, 3)
    assert len(got) == len(expected)
    off = np.abs(got[:, None] - expected).max(axis=2)
    assert (off.min(axis=0, initial=np.inf) < 1e-4).all()
    assert (off.min(axis=1, initial=np.inf) < 1e-4).all()


@given(SEEDS)
@example(100)  # left in one cell, and taken up again, it goes on to the one before it in memory
@settings(max_examples=12, deadline=None)
def test_a_base_is_swept_whole(seed: int) -> None:
    """Every pose that going through all pairs of walls gives is proposed, and no other."""
    d = drawn(seed, radius=7.0)
    base = base_of(d)
    if base is None:
        return
    expected = twin.placements(d.scan, *base, INDEX.runs.rows, GATES)
    whole = swept(asked(d), base)
    for budget in (1, 150):
        pieces = swept(asked(d), base, budget)
        assert whole.proposed == pieces.proposed == len(expected)
        np.testing.assert_array_equal(pieces.poses, whole.poses)
        assert whole.calls == 1
        assert pieces.calls > 1 or not expected


@pytest.mark.parametrize(("count", "apart"), [(30, 0.04), (AT_ONCE + 44, 0.035), (AT_ONCE + 44, 2.5)])
@pytest.mark.parametrize("listed", [-1, 1])
def test_what_is_met_at_once_is_gone_through_in_pieces(count: int, apart: float, listed: int) -> None:
    """10,000 walls through one point held a search for 5 s beyond its deadline.

    Few of them; more than fit a stage, in few cells; and in more cells than fit one.
    """
    x, y = apart * np.arange(count), np.full(count, 5.0)
    index = index_of(np.vstack([[[-5.0, 0.0, x[-1] + 5.0, 0.0]], np.stack([x, -y, x, y], axis=1)]))
    scan = scan_of([[-2.0, 0.0, 2.0, 0.0], [0.0, -2.0, 0.0, 2.0]])
    question, chosen = context_of(index, scan).question(ALL), record(BASE, sliding=0, crossing=1, listed=listed)

    def steps(budget: int) -> tuple[list[int], Records]:
        """Return how many poses each call proposed, and what was found."""
        found, progress, proposed = np.zeros(20_000, FOUND), record(PROGRESS), [0]
        work = workspace_of(question.scan, index)
        while progress["bases"][0] == 0:
            proposing.search_base(question, index.tables, chosen[0], found, progress[0], work, budget)
            proposed.append(int(progress["hypotheses"][0]))
        return np.diff(proposed).tolist(), found

    (all_at_once, whole), (one_by_one, pieces) = steps(10**9), steps(1)
    assert all_at_once[0] == sum(one_by_one) == count
    assert max(one_by_one) == 1
    np.testing.assert_array_equal(pieces, whole)
    for most in (20, AT_ONCE + 10):  # it stops where a stage was begun anew, too
        some, again = steps(most * TESTS_REFINED)
        assert sum(some) == count
        assert max(some) <= most
        np.testing.assert_array_equal(again, whole)


def test_what_is_met_and_does_not_fit_is_not_met_again() -> None:
    """Of many runs in one place most are too far off: between these the search stops, too."""
    count = AT_ONCE + 5
    x, low = 0.0005 * np.arange(count), np.where(np.arange(count) < AT_ONCE, 0.9, -9.0)
    index = index_of(np.vstack([[[-5.0, 0.0, 7.0, 0.0]], np.stack([x, low, x, low + 18.0], axis=1)]))
    scan = scan_of([[-2.0, 0.0, 2.0, 0.0], [0.0, -1.9, 0.0, 1.9]])
    question, chosen = context_of(index, scan).question(ALL), record(BASE, sliding=0, crossing=1, listed=-1)
    found, progress, work, stood = np.zeros(20_000, FOUND), record(PROGRESS), workspace_of(question.scan, index), set()
    while progress["bases"][0] == 0:
        proposing.search_base(question, index.tables, chosen[0], found, progress[0], work, 1)
        stood.add(progress[["anchor", "step", "entry"]][0].item())
    assert progress["hypotheses"][0] == 5 + 1  # on the runs that fit, and on the one that they make up
    assert len(stood) > 5 + 1


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_a_base_of_which_the_crossings_are_listed_is_gone_through_whole(seed: int) -> None:
    """As when it is swept; also what tells little of its angle, and sticks out of its runs."""
    d = drawn(seed, radius=7.0)
    d.scan["angle_variance"] *= 10.0 ** d.rng.uniform(0.0, 2.0, len(d.scan))
    base = base_of(d, 0.3)
    if base is None:
        return
    a, b = d.scan[list(base)]
    base = base if a["dx"] * b["dy"] > a["dy"] * b["dx"] else base[::-1]
    question = asked(d)
    question.scan["angle_variance"] = d.scan["angle_variance"]
    if entries_of(question.scan, base, INDEX.crossings) < 0:
        return  # lines that cross at a small angle, far away
    expected = twin.placements(d.scan, *base, INDEX.runs.rows, GATES)
    whole, pieces = swept(question, base, listed=1), swept(question, base, 1, listed=1)
    assert whole.proposed == pieces.proposed == len(expected)
    np.testing.assert_array_equal(pieces.poses, whole.poses)
    assert whole.calls == 1
    assert pieces.calls > 1 or not expected


@pytest.mark.parametrize(("length", "apart", "end"), [(1.0, 31.7, 32.2), (0.3, 31.8, 31.97), (0.3, 3.8, 3.97)])
@pytest.mark.parametrize("first", [0, 1])
def test_wherever_a_base_lies_its_crossings_are_looked_up(length: float, apart: float, end: float, first: int) -> None:
    """A segment across another, far or near, up to beyond the end of its run; and where a cell of the lists ends."""
    along = np.array([[-9.0, 0.0, 9.0, 0.0], [-1.5, 0.0, 1.5, 0.0]])
    wall, long = along[:, [0, 1, 2, 3] if first == 0 else [2, 3, 0, 1]]  # what is short is to its left, or it to that's
    index, proposed = index_of([wall, [0.0, min(1.0, end - 10.0), 0.0, end], [60.0, 60.0, 61.0, 60.0]]), []
    for middle in apart + 0.003 * np.arange(110):
        scan = scan_of([long, [0.0, middle - 0.5 * length, 0.0, middle + 0.5 * length]])
        question = context_of(index, scan).question(ALL)
        assert question.scan["length"][0] == 3.0
        found, progress, work = np.zeros(20, FOUND), record(PROGRESS), workspace_of(question.scan, index)
        chosen = record(BASE, sliding=first, crossing=1 - first, listed=1)
        proposing.search_base(question, index.tables, chosen[0], found, progress[0], work, 10**9)
        proposed.append(int(progress["hypotheses"][0]))
        assert proposed[-1] == len(twin.placements(question.scan, first, 1 - first, index.runs.rows, GATES))
    assert set(proposed) == {0, 1}


def test_only_what_crosses_at_about_the_angle_of_a_base_is_proposed_within_the_window() -> None:
    """Of a fan of runs, half a degree apart, those up to four degrees off; of these, what a prior lets through."""
    angles = np.radians(90.0 + 0.5 * np.arange(-30, 31))
    middles = np.stack([0.8 * np.arange(61), np.full(61, 3.0)], axis=1)
    half = 2.5 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    index = index_of(np.vstack([[[-9.0, 0.0, 60.0, 0.0]], np.hstack([middles - half, middles + half])]))
    scan = scan_of([[-3.0, 0.0, 3.0, 0.0], [0.0, 1.0, 0.0, 5.0]])
    ways = twin.placements(context_of(index, scan).lines.rows, 0, 1, index.runs.rows, GATES)
    window = HardPrior(ways[len(ways) // 2].pose, 1.0, 0.5)
    inside = [way for way in ways if twin.may_be_refined_into(window, way.pose)]
    assert 0 < len(inside) < len(ways) < 30
    moved_window = HardPrior(moved(window.pose, [0.0, *index.origin]), 1.0, 0.5)
    for prior, expected in ((None, ways), (moved_window, inside)):
        question, found, progress = context_of(index, scan, prior).question(ALL), np.zeros(99, FOUND), record(PROGRESS)
        chosen, work = record(BASE, sliding=0, crossing=1, listed=1), workspace_of(question.scan, index)
        proposing.search_base(question, index.tables, chosen[0], found, progress[0], work, 10**9)
        assert progress["hypotheses"][0] == len(expected)


@given(SEEDS)
@settings(max_examples=6, deadline=None)
def test_what_a_base_proposes_is_refined_and_kept(seed: int) -> None:
    """With a window all that lies in it, for which less is looked at."""
    d = drawn(seed, radius=6.0)
    base = base_of(d, 2.0)
    if base is None:
        return
    proposals = twin.placements(d.scan, *base, INDEX.runs.rows, GATES)
    assert_found(swept(asked(d), base), d.scan, proposals)
    for radius, angle in ((0.3, 0.05), (4.0, 3.2)):
        window = HardPrior(d.near(0.02, 0.1, 0.1), radius, angle)
        some = swept(asked(d, window), base)
        assert_found(some, d.scan, proposals, window)
        assert some.proposed <= len(proposals)


@given(SEEDS)
@example(74845286)  # where a consensus set loses all its pairs
@example(1)  # where pairs come in the last round that are worth nothing
@settings(max_examples=4, deadline=None)
def test_a_segment_slides_along_every_wall(seed: int) -> None:
    d = drawn(seed, radius=6.0)
    sliding, spacing = int(d.rng.integers(len(d.scan))), 0.7
    proposals = twin.slides(d.scan[sliding], INDEX.runs.rows, spacing)
    whole, pieces = slid(asked(d), sliding, spacing), slid(asked(d), sliding, spacing, 1)
    assert_found(whole, d.scan, proposals)
    assert whole.proposed == pieces.proposed == len(proposals)
    np.testing.assert_array_equal(pieces.poses, whole.poses)
    assert whole.calls == 1 < pieces.calls
    for radius, angle in ((0.3, 0.05), (1.0, 3.2)):
        window = HardPrior(d.near(0.02, 0.1, 0.1), radius, angle)
        step = 0.31  # which no window is a whole multiple of: then the last bit would decide how many steps there are
        some, within = (
            slid(asked(d, window), sliding, step),
            twin.slides(d.scan[sliding], INDEX.runs.rows, step, window),
        )
        assert_found(some, d.scan, within, window)
        assert some.proposed == len(within)


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_try_poses(seed: int) -> None:
    """Each is looked at only as far as it may still be kept beside those before it, and each step is counted."""
    d = drawn(seed, radius=7.0)
    variance, pin = SMALL[2, 2] * 10.0 ** d.rng.uniform(-1.0, 1.0), d.rng.uniform(-2.0, 2.0, 2)
    window = HardPrior(d.near(), 0.5, 0.2) if seed % 2 else None
    question, work = asked(d, window), workspace_of(d.scan)
    question.rules["kept_share"] = 0.65
    if whole := d.rng.random() < 0.7:
        work.spreads[:], _ = gates_about(d.scan, variance, np.zeros(2), 0.0, GATES)
        work.later[:] = d.scan["later_gain"]
    else:
        question.terms["gates"]["least_overlap"] = 0.4  # a midpoint may then be off the map: the raster knows nothing
    gates = question.terms["gates"]
    places = [d.near(0.3, 3.0, 3.0), d.near(0.1, 0.5, 0.5), d.near(), d.at, d.near(0.1, 0.5, 0.5)]
    best_value = d.rng.uniform(0.0, 1.0) * d.scan["gain"].sum()
    progress, found = record(PROGRESS, best_value=best_value), np.zeros(9, FOUND)
    progress["least_freedom"] = d.rng.choice([0.0, 10.0])
    for k, (one, at) in enumerate(zip(work.posed, places, strict=False)):
        one["x"], one["y"], one["theta"] = at.x, at.y, at.theta
        one["cosine"], one["sine"] = math.cos(at.theta), math.sin(at.theta)
        one["lever_x"], one["lever_y"] = RigidTransform(0.0, 0.0, at.theta).apply(pin)
        one["angle_variance"] = variance
        one["anchor"], one["step"], one["entry"] = 100 + k, 10 + k, k
    expected, kept_scores = [], [0.0]
    for at in places:
        least = 0.65 * best_value
        floor = least + progress["least_freedom"][0]
        x, y = RigidTransform(0.0, 0.0, at.theta).apply(pin)
        turning = np.array([y, -x, 1.0])
        covariance = variance * np.outer(turning, turning)
        outside = window is not None and not twin.may_be_refined_into(window, at)
        if outside or (whole and reachable(d.scan, at, work.spreads, work.shifts, TABLES.raster) < floor):
            expected.append((0, TESTS_REJECTED))
        elif match_scan(d.scan, at, covariance, PLACE, gates)[1] < floor:
            expected.append((0, TESTS_HYPOTHESIS))
        else:
            refined = refine(d.scan, at, covariance, PLACE, gates, MODEL, ROUNDS)
            inside = window is None or window.contains(refined.pose)
            kept = refined.score > 0.0 and refined.score >= least and inside
            expected.append((1, TESTS_REFINED))
            kept_scores += [refined.score] if kept else []
            best_value = max(best_value, *kept_scores)
    # All of them; and one at a time, each from where the one before it left off.
    spent, stopped = trying.try_poses(question, TABLES, len(places), found, progress[0], work, 10**9)
    assert not stopped
    assert (progress["hypotheses"][0], progress["verified"][0]) == (len(places), sum(one[0] for one in expected))
    assert spent == sum(one[1] for one in expected)
    assert found["value"].max() == pytest.approx(max(kept_scores))
    progress["hypotheses"] = 0
    spent, stopped = trying.try_poses(question, TABLES, len(places), found, progress[0], work, 0)
    assert stopped
    assert progress[0][["hypotheses", "anchor", "step", "entry"]].item() == (1, 100, 10, 0)
