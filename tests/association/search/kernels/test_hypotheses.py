"""All poses that a base allows become hypotheses, and no other."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import example, given, settings

from association import HardPrior, MapIndex
from association.consensus.tuning import ROUNDS
from association.layout import HYPOTHESIS, RULES, record
from association.search.kernels import hypotheses, sweeping
from association.search.kernels.sliding import search_slides
from association.search.layout import BASE
from association.search.tables import SearchState
from association.tables import Question
from association.tuning import AT_ONCE
from registration.layout import Records

from ...kernels.drawn import GATES, INDEX, MODEL, PLACE, SEEDS, TABLES, Drawn, drawn, oblique, workspace_of
from ...kernels.plans import entries_of, state_of, stored_in
from ...records import pose_of
from ...reference import proposing as twin
from ...reference.consensus import refine
from ...reference.geometry import moved
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
    runs, out, length = oblique(rng).chains, np.zeros(60, np.int64), rng.uniform(0.3, 7.0)
    lengths = runs.rows["end"] - runs.rows["begin"]
    count = sweeping.anchors(length, lengths, out)
    assert out[:count].tolist() == np.nonzero(lengths >= length - 2.0 * twin.end_slack(length))[0].tolist()


@given(SEEDS)
@settings(max_examples=100, deadline=None)
def test_base_pose(seed: int) -> None:
    """The first tells more of the angle, or the second; at the ends of the walls, too."""
    d = drawn(seed)
    d.scan["angle_variance"] *= 10.0 ** d.rng.uniform(0.0, 2.0, len(d.scan))
    runs = oblique(d.rng).chains.rows
    a, b = d.scan[d.rng.choice(len(d.scan), 2, replace=False)]
    for wa, wb in itertools.permutations(runs[d.rng.choice(len(runs), 4, replace=False)], 2):
        if abs(wa["dx"] * wb["dy"] - wa["dy"] * wb["dx"]) < 0.1:
            continue
        at, inside = twin.base_pose(a, b, wa, wb)
        out = np.zeros(1, HYPOTHESIS)
        assert bool(hypotheses.base_pose(a, b, wa, wb, out[0])) is inside
        assert same_pose(pose_of(out[0]), at, 1e-9, 1e-9)
        assert (out["cosine"][0], out["sine"][0]) == pytest.approx((math.cos(at.theta), math.sin(at.theta)), abs=1e-12)


@pytest.mark.parametrize("angle", [0.0, -1e-9, 0.07, -0.2999, 0.3001, -1.0, 3.0])
def test_what_is_turned_a_little(angle: float) -> None:
    """By their series where that is exact, and as by the library beyond."""
    for heading in np.linspace(-4.0, 4.0, 9).tolist():
        turned = hypotheses.turn_a_little(math.cos(heading), math.sin(heading), angle)
        assert turned == pytest.approx((math.cos(heading + angle), math.sin(heading + angle)), abs=3e-15)


@pytest.mark.parametrize(("slide", "inside"), [(-0.01, False), (0.01, True), (2.99, True), (3.01, False)])
@pytest.mark.parametrize("second", [False, True])
def test_a_base_may_stick_out_of_its_walls_a_little(slide: float, inside: bool, second: bool) -> None:
    """A segment of 2 m by 40 cm; hence on a wall of 4.2 m there are 3 m for its midpoint."""
    rows = index_of([[0.0, 0.0, 4.2, 0.0], [20.0, -9.0, 20.0, 9.0]]).chains.rows
    wa, wb = rows[np.argsort(rows["end"] - rows["begin"])]
    d = drawn(0)
    a, b = d.scan[:1].copy(), d.scan[1:2].copy()
    for one, wall, along in ((a, wa, wa["begin"] + 0.6 + slide), (b, wb, 0.0)):
        one["dx"], one["dy"], one["angle"], one["length"] = wall["dx"], wall["dy"], wall["angle"], 2.0
        one["x"] = along * wall["dx"] - wall["offset"] * wall["dy"]
        one["y"] = along * wall["dy"] + wall["offset"] * wall["dx"]
    pair = (b[0], a[0], wb, wa) if second else (a[0], b[0], wa, wb)
    assert bool(hypotheses.base_pose(*pair, np.zeros(1, HYPOTHESIS)[0])) is inside


def asked(d: Drawn, window: HardPrior | None = None) -> Question:
    """Ask for all poses there are; the window is one of the index frame."""
    if window is not None:
        window = HardPrior(moved(window.pose, [0.0, *INDEX.origin]), window.radius, window.angle)
    return context_of(INDEX, scan_of(d.endpoints), window).question(ALL)


def swept(question: Question, base: tuple[int, int], *, listed: int = -1, index: MapIndex = INDEX) -> SearchState:
    """Search a base; where it is `listed`, by the lists of crossings."""
    state, chosen = state_of(), record(BASE, sliding=base[0], crossing=base[1], listed=listed)
    assert hypotheses.search_base(question, index.tables, chosen[0], state, workspace_of(question.scan, index))
    return state


def slid(question: Question, sliding: int, spacing: float) -> SearchState:
    """Slide a segment."""
    state = state_of()
    assert search_slides(question, TABLES, sliding, state, workspace_of(question.scan), spacing)
    return state


def proposed(state: SearchState) -> int:
    return int(state.statistics["hypotheses"][0])


def assert_found(
    state: SearchState, scan: Records, proposals: list[twin.Proposal], window: HardPrior | None = None
) -> None:
    """Compare with the proposals, refined, that score and lie in the window."""
    if window is not None:
        proposals = [one for one in proposals if twin.may_be_refined_into(window, one.pose)]
    refined = [refine(scan, one.pose, one.covariance, PLACE, GATES, MODEL, ROUNDS) for one in proposals]
    refined = [one for one in refined if one.score > 0.0 and (window is None or window.contains(one.pose))]
    expected = np.array([(one.score, one.pose.x, one.pose.y) for one in refined]).reshape(-1, 3)
    got = np.array(stored_in(state)[["score", "x", "y"]].tolist()).reshape(-1, 3)
    assert len(got) == len(expected)
    off = np.abs(got[:, None] - expected).max(axis=2)
    assert (off.min(axis=0, initial=np.inf) < 1e-4).all()
    assert (off.min(axis=1, initial=np.inf) < 1e-4).all()


@given(SEEDS)
@settings(max_examples=12, deadline=None)
def test_a_base_is_swept_whole(seed: int) -> None:
    """Every pose that all pairs of wall chains give becomes a hypothesis, and no other."""
    d = drawn(seed, radius=7.0)
    base = base_of(d)
    if base is not None:
        expected = twin.placements(d.scan, *base, INDEX.chains.rows, GATES)
        assert proposed(swept(asked(d), base)) == len(expected)


@pytest.mark.parametrize(("count", "apart"), [(30, 0.04), (AT_ONCE + 44, 0.035), (AT_ONCE + 44, 2.5)])
@pytest.mark.parametrize("listed", [-1, 1])
def test_more_walls_than_are_met_at_once(count: int, apart: float, listed: int) -> None:
    """Few walls; more than fit a stage, in few cells; and in more cells than fit one."""
    x, y = apart * np.arange(count), np.full(count, 5.0)
    index = index_of(np.vstack([[[-5.0, 0.0, x[-1] + 5.0, 0.0]], np.stack([x, -y, x, y], axis=1)]))
    scan = scan_of([[-2.0, 0.0, 2.0, 0.0], [0.0, -2.0, 0.0, 2.0]])
    question = context_of(index, scan).question(ALL)
    assert proposed(swept(question, (0, 1), listed=listed, index=index)) == count


def test_walls_that_are_met_and_do_not_fit_are_left_out() -> None:
    """Of many in one place most are too far off."""
    count = AT_ONCE + 5
    x, low = 0.0005 * np.arange(count), np.where(np.arange(count) < AT_ONCE, 0.9, -9.0)
    index = index_of(np.vstack([[[-5.0, 0.0, 7.0, 0.0]], np.stack([x, low, x, low + 18.0], axis=1)]))
    scan = scan_of([[-2.0, 0.0, 2.0, 0.0], [0.0, -1.9, 0.0, 1.9]])
    question = context_of(index, scan).question(ALL)
    assert proposed(swept(question, (0, 1), index=index)) == 5 + 1  # those that fit, and the chain that they make up


@pytest.mark.parametrize("listed", [-1, 1])
def test_a_search_that_has_to_end_leaves_a_base_undone(listed: int) -> None:
    question, state = asked(drawn(3, radius=7.0)), state_of()
    state.stop[0] = 1
    chosen, work = record(BASE, sliding=0, crossing=1, listed=listed), workspace_of(question.scan)
    assert not hypotheses.search_base(question, TABLES, chosen[0], state, work)
    assert not search_slides(question, TABLES, 0, state, work, 0.7)
    assert proposed(state) == 0


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_a_base_of_which_the_crossings_are_listed_is_searched_whole(seed: int) -> None:
    """As when it is swept; also where its angle is imprecise, and it sticks out of its chains."""
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
    expected = twin.placements(d.scan, *base, INDEX.chains.rows, GATES)
    assert proposed(swept(question, base, listed=1)) == len(expected)


@pytest.mark.parametrize(("length", "apart", "end"), [(1.0, 31.7, 32.2), (0.3, 31.8, 31.97), (0.3, 3.8, 3.97)])
@pytest.mark.parametrize("first", [0, 1])
def test_wherever_a_base_lies_its_crossings_are_looked_up(length: float, apart: float, end: float, first: int) -> None:
    """A segment across another, far or near, up to beyond the end of its chain; and where a cell of the lists ends."""
    along = np.array([[-9.0, 0.0, 9.0, 0.0], [-1.5, 0.0, 1.5, 0.0]])
    wall, long = along[:, [0, 1, 2, 3] if first == 0 else [2, 3, 0, 1]]  # what is short is to its left, or it to that's
    index, counts = index_of([wall, [0.0, min(1.0, end - 10.0), 0.0, end], [60.0, 60.0, 61.0, 60.0]]), set()
    for middle in apart + 0.003 * np.arange(110):
        scan = scan_of([long, [0.0, middle - 0.5 * length, 0.0, middle + 0.5 * length]])
        question = context_of(index, scan).question(ALL)
        assert question.scan["length"][0] == 3.0
        count = proposed(swept(question, (first, 1 - first), listed=1, index=index))
        assert count == len(twin.placements(question.scan, first, 1 - first, index.chains.rows, GATES))
        counts.add(count)
    assert counts == {0, 1}


def test_only_what_crosses_at_about_the_angle_of_a_base_is_proposed_within_the_window() -> None:
    """Of a fan of chains, half a degree apart, those up to four degrees off; of these, what a prior lets through."""
    angles = np.radians(90.0 + 0.5 * np.arange(-30, 31))
    middles = np.stack([0.8 * np.arange(61), np.full(61, 3.0)], axis=1)
    half = 2.5 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    index = index_of(np.vstack([[[-9.0, 0.0, 60.0, 0.0]], np.hstack([middles - half, middles + half])]))
    scan = scan_of([[-3.0, 0.0, 3.0, 0.0], [0.0, 1.0, 0.0, 5.0]])
    ways = twin.placements(context_of(index, scan).lines.rows, 0, 1, index.chains.rows, GATES)
    window = HardPrior(ways[len(ways) // 2].pose, 1.0, 0.5)
    inside = [way for way in ways if twin.may_be_refined_into(window, way.pose)]
    assert 0 < len(inside) < len(ways) < 30
    moved_window = HardPrior(moved(window.pose, [0.0, *index.origin]), 1.0, 0.5)
    for prior, expected in ((None, ways), (moved_window, inside)):
        question = context_of(index, scan, prior).question(ALL)
        assert proposed(swept(question, (0, 1), listed=1, index=index)) == len(expected)


@given(SEEDS)
@settings(max_examples=6, deadline=None)
def test_what_a_base_proposes_is_refined_and_kept(seed: int) -> None:
    """With a window all that lies in it, for which less is looked at."""
    d = drawn(seed, radius=6.0)
    base = base_of(d, 2.0)
    if base is None:
        return
    proposals = twin.placements(d.scan, *base, INDEX.chains.rows, GATES)
    assert_found(swept(asked(d), base), d.scan, proposals)
    for radius, angle in ((0.3, 0.05), (4.0, 3.2)):
        window = HardPrior(d.near(0.02, 0.1, 0.1), radius, angle)
        some = swept(asked(d, window), base)
        assert_found(some, d.scan, proposals, window)
        assert proposed(some) <= len(proposals)


@given(SEEDS)
@example(74845286)  # where a consensus set loses all its pairs
@example(1)  # where pairs of no gain come in the last round
@settings(max_examples=4, deadline=None)
def test_a_segment_slides_along_every_wall(seed: int) -> None:
    d = drawn(seed, radius=6.0)
    sliding, spacing = int(d.rng.integers(len(d.scan))), 0.7
    proposals = twin.slides(d.scan[sliding], INDEX.chains.rows, spacing)
    whole = slid(asked(d), sliding, spacing)
    assert_found(whole, d.scan, proposals)
    assert proposed(whole) == len(proposals)
    for radius, angle in ((0.3, 0.05), (1.0, 3.2)):
        window = HardPrior(d.near(0.02, 0.1, 0.1), radius, angle)
        step = 0.31  # which no window is a whole multiple of: then the last bit would decide how many steps there are
        some, within = (
            slid(asked(d, window), sliding, step),
            twin.slides(d.scan[sliding], INDEX.chains.rows, step, window),
        )
        assert_found(some, d.scan, within, window)
        assert proposed(some) == len(within)
