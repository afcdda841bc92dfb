"""The search goes on until nothing better can have been missed, and says honestly how far it came."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from association import CancelledError, Deadline, HardPrior, MapIndex, Scan, SearchReport
from association.consensus.tuning import ROUNDS
from association.search.candidates import Candidates, find_candidates
from association.search.kernels.bases import pair_up
from association.search.tuning import BASE_SEGMENTS, KEPT_SHARE, KEPT_SHARE_FOR_BEAMS, REUSE, TELLING_SEGMENTS
from association.tuning import RIVAL_SHARE
from registration import RigidTransform
from registration.layout import Records

from ..kernels.plans import bases_of
from ..reference import planning
from ..reference.consensus import refine
from ..scenes import (
    CORRIDOR,
    INSIDE,
    ROOM,
    beams_of,
    context_of,
    equal_rooms,
    index_of,
    local,
    maze,
    pose,
    scan_of,
    seen,
)

ROOM_INDEX = index_of(ROOM)
ROOM_SCAN = scan_of(seen(ROOM, INSIDE)[0])
MAZE_INDEX = index_of(maze(1))
MAZE_SCAN = scan_of(seen(maze(1), pose(15.0, 14.0, 0.5), noise=0.02, cut=0.4, clutter=4, radius=8.0)[0])
CAMPUS = index_of(np.vstack([equal_rooms(10) + np.tile([0.0, 12.0 * k], 2) for k in range(10)]))


@dataclass(frozen=True)
class Charged:
    """Of a consensus set, nats."""

    gain: float
    score: float


def found(index: MapIndex, scan: Scan, **how: Any) -> Candidates:
    return find_candidates(context_of(index, scan, **how))


def test_what_is_found_comes_best_first() -> None:
    values = found(index_of(equal_rooms(3)), ROOM_SCAN).poses["value"]
    assert len(values) >= 3
    assert (np.diff(values) <= 0.0).all()
    assert (values >= 0.0).all()


def test_what_slides_comes_beside_what_bases_give() -> None:
    """A base lies on an L, and gains 22 nats; two of its walls without the third lie in a corridor, and gain 28."""
    walls = np.vstack([CORRIDOR, [[50.0, 20.0, 80.0, 20.0], [70.0, 20.0, 70.0, 21.0]]])
    scan = scan_of([[-4.0, -0.8, 4.5, -0.8], [4.5, 1.2, -4.0, 1.2], [2.0, -0.8, 2.0, 0.2]])
    index = index_of(walls)
    candidates = found(index, scan)
    values = candidates.poses["value"]
    assert (np.diff(values) <= 0.0).all()
    in_corridor, on_corner = (charged(index, scan, at) for at in (pose(15.0, 0.8), pose(68.0, 20.8)))
    assert in_corridor.gain == pytest.approx(28.0)
    assert on_corner.gain == pytest.approx(22.0)
    assert values.max() == pytest.approx(in_corridor.score, abs=1e-3)
    assert values.min() == pytest.approx(on_corner.score, abs=1e-3)
    assert 0 < candidates.report.bases <= 2


def charged(index: MapIndex, scan: Scan, at: RigidTransform) -> Charged:
    """Return what is gained at a pose, and what remains after the freedom that it takes."""
    context = context_of(index, scan)
    rows, place, model = context.lines.rows, index.tables.place, context.lines.model
    found = refine(rows, local(index, at), np.diag([1e-4, 1e-4, 1e-6]), place, context.gates, model, ROUNDS)
    on = found.matches["wall"] >= 0
    return Charged(float((rows["gain"] * found.matches["overlap"])[on].sum()), found.score)


def test_how_bases_are_drawn_is_told() -> None:
    window = HardPrior(INSIDE, 0.5, 0.3)
    for prior in (None, window):
        told = found(ROOM_INDEX, ROOM_SCAN, prior=prior, seed=7).report
        assert (told.seed, told.sampling, told.complete_above) == (7, "ordered", RIVAL_SHARE)
        assert found(ROOM_INDEX, ROOM_SCAN, prior=prior, sampling="random").report.sampling == "random"


def drawn_with(seed: int, sampling: str, confidence: float = 0.9) -> tuple[list[tuple[float, ...]], SearchReport]:
    """Return what is found of a scan of many segments, and how."""
    scan = scan_of(seen(maze(1), pose(15.0, 14.0, 0.5), noise=0.02, cut=0.4, clutter=12, radius=9.0)[0])
    candidates = found(MAZE_INDEX, scan, sampling=sampling, seed=seed, confidence=confidence)
    return candidates.poses.tolist(), candidates.report


def test_the_seed_draws_the_bases_where_they_are_drawn_at_random() -> None:
    """And to the bit; in order they are the same whatever the seed."""
    reports = [drawn_with(seed, "random")[1] for seed in range(6)]
    assert len({(one.bases, one.hypotheses) for one in reports}) >= 4
    for seed in range(3):
        assert drawn_with(seed, "random") == drawn_with(seed, "random")
    (poses, report), (others, other) = drawn_with(0, "ordered"), drawn_with(5, "ordered")
    assert poses == others
    assert replace(report, seed=5) == other


@pytest.mark.parametrize("confidence", [0.5, 0.9, 0.99])
def test_random_bases_end_when_as_many_draws_would_have_hit(confidence: float) -> None:
    """Five inliers at least among twelve segments: a draw has two of them with a chance of 20 in 132."""
    index, scan = twelve()
    whole = math.log(1.0 - confidence) / math.log(1.0 - 20.0 / 132.0)
    for seed in range(5):
        report = found(index, scan, sampling="random", seed=seed, confidence=confidence).report
        assert report.complete
        assert not report.exhaustive
        assert confidence <= report.confidence <= 1.0 - (1.0 - 20.0 / 132.0) ** report.bases + 1e-9
        assert report.confidence < 1.0 - (1.0 - confidence) * (1.0 - 20.0 / 132.0), "no draw more than are needed"
        assert report.bases >= math.floor(whole)


@pytest.mark.parametrize("seed", range(4))
def test_random_bases_find_the_truth(seed: int) -> None:
    """Half of a maze's walls hidden, and a third of the segments from no wall."""
    at = pose(12.0 + 2.0 * seed, 17.0 - seed, 0.7 * seed)
    scan = scan_of(seen(maze(1), at, noise=0.02, cut=0.5, clutter=8, seed=seed, radius=9.0)[0])
    poses = [found(MAZE_INDEX, scan, sampling="random", seed=k).poses[0] for k in range(3)]
    here = local(MAZE_INDEX, at)
    for best in poses:
        assert math.hypot(best["x"] - here.x, best["y"] - here.y) < 0.1
        assert abs(math.remainder(best["theta"] - here.theta, math.tau)) < 0.02


def twelve() -> tuple[MapIndex, Scan]:
    """Return six walls of four metres and more, and a scan of them with six segments as long of none."""
    clutter = [[30.0 + 3.0 * k, 0.0, 30.0 + 3.0 * k + 4.5 * math.cos(k), 4.5 * math.sin(k)] for k in range(6)]
    walls = [[0, 0, 9, 0], [9, 0, 9, 4.5], [9, 4.5, 4.6, 4.5], [4.6, 4.5, 4.6, 9], [4.6, 9, 0, 9], [0, 9, 0, 0]]
    return index_of(walls), scan_of([*walls, *clutter])


BASE = ["sliding", "crossing", "merit"]


def bases_in(index: MapIndex, scan: Scan) -> list[planning.Base]:
    rows = context_of(index, scan).lines.rows
    bases: list[planning.Base] = bases_of(rows, len(rows), index.chains, index.area, index.crossings)[BASE].tolist()
    return bases


def test_an_exhaustive_search_searches_all_bases() -> None:
    scan = scan_of(seen(maze(1), pose(15.0, 14.0, 0.5), noise=0.02, cut=0.2, clutter=4, radius=10.0)[0])
    count = len(bases_in(MAZE_INDEX, scan))
    whole = found(MAZE_INDEX, scan, exhaustive=True).report
    assert (whole.complete, whole.exhaustive, whole.confidence, whole.bases) == (True, True, 1.0, count)
    usual = found(MAZE_INDEX, scan).report
    assert (usual.complete, usual.exhaustive) == (True, False)
    assert usual.bases < count
    assert usual.confidence >= 0.9999
    assert 0 < usual.verified <= usual.hypotheses < whole.hypotheses
    assert whole.verified < whole.hypotheses


def test_without_bases_there_is_nothing_to_go_through() -> None:
    """Parallel walls alone, or none."""
    for endpoints in (seen(CORRIDOR, pose(4.0, 0.8))[0], np.zeros((0, 4))):
        report = found(index_of(CORRIDOR), scan_of(endpoints)).report
        assert (report.complete, report.exhaustive, report.confidence, report.bases) == (True, True, 1.0, 0)


@pytest.mark.parametrize("sampling", ["ordered", "random"])
def test_of_many_parallel_walls_nothing_is_missed(sampling: str) -> None:
    """They make no bases however many they are, and are slid."""
    walls = np.array([[0.0, 3.0 * k, 30.0, 3.0 * k] for k in range(BASE_SEGMENTS + 5)])
    report = found(index_of(walls), scan_of(walls - [10.0, 0.0, 10.0, 0.0]), sampling=sampling).report
    assert (report.bases, report.confidence) == (0, 1.0)


@pytest.mark.parametrize(("count", "exhaustive"), [(BASE_SEGMENTS, True), (BASE_SEGMENTS + 1, False)])
def test_a_scan_of_many_segments_is_not_gone_through_whole(count: int, exhaustive: bool) -> None:
    """Bases are made of the most telling ones."""
    rng = np.random.default_rng(0)
    begins, turns = rng.uniform(-9.0, 9.0, (count, 2)), rng.uniform(-math.pi, math.pi, count)
    scan = scan_of(np.hstack([begins, begins + np.stack([np.cos(turns), np.sin(turns)], axis=1)]))
    report = found(ROOM_INDEX, scan, exhaustive=True).report
    assert report.exhaustive is exhaustive
    assert (report.confidence == 1.0) is exhaustive, "what others may hold was not looked for"


@pytest.mark.parametrize("clutter", [20, 40])
def test_a_scan_of_many_segments_needs_no_more_bases(clutter: int) -> None:
    """Half of the segments are of no wall; those of the walls are more than the longest forty hold."""
    scan = scan_of(seen(maze(1), pose(15.0, 14.0, 0.5), noise=0.02, cut=0.2, clutter=clutter, radius=14.0)[0])
    assert len(context_of(MAZE_INDEX, scan).lines.rows) > TELLING_SEGMENTS[0]
    report = found(MAZE_INDEX, scan).report
    assert report.confidence >= 0.9999
    assert report.bases < 60


def missed(index: MapIndex, scan: Scan, bases: int, fewest: int) -> float:
    """Count the sets of `fewest` segments that hold none of the first bases; return their share."""
    plan, rows = bases_in(index, scan), context_of(index, scan).lines.rows
    order = planning.order_of(plan, math.log(REUSE), pair_up(rows, len(rows))["merit"].tolist())
    tried = [set(plan[k][:2]) for k in order[:bases]]
    sets = list(itertools.combinations(range(len(scan.measured)), fewest))
    return sum(not any(base <= set(one) for base in tried) for one in sets) / len(sets)


@pytest.mark.parametrize("confidence", [0.5, 0.9, 0.99])
def test_the_confidence_is_the_share_of_sets_that_cannot_have_been_missed(confidence: float) -> None:
    """Six walls of four metres and more among twelve segments, each with a gain of 14 nats.

    They score 73.6 nats, an alternative has three quarters of it, 55.2. Its freedom takes 5.2 nats at least: it gains
    more than four of them, so that it has five.
    """
    index, scan = twelve()
    report, least = found(index, scan, confidence=confidence).report, found(index, scan, confidence=0.5).report
    assert report.confidence >= confidence
    assert report.confidence == pytest.approx(1.0 - missed(index, scan, report.bases, 5), abs=0.015)
    assert report.bases == least.bases or 1.0 - missed(index, scan, report.bases - 1, 5) < confidence + 0.015


def test_where_beams_are_to_decide_more_is_kept() -> None:
    """A room whose similar place lacks a wall scores 0.6 of it: an alternative by beams, not by segments."""
    twin = ROOM[[0, 1, 3, 6, 7]] + np.tile([20.0, 0.0], 2)
    index = index_of(np.vstack([ROOM, twin]))
    endpoints = seen(ROOM, INSIDE)[0]
    plain = found(index, scan_of(endpoints)).poses
    rich = found(index, scan_of(endpoints, viewpoint=(0.0, 0.0), beams=beams_of(index, INSIDE))).poses
    lesser = KEPT_SHARE_FOR_BEAMS < found_at(rich, index, 23.0) / rich["value"][0] < KEPT_SHARE
    assert lesser
    assert found_at(plain, index, 23.0) == 0.0


def found_at(poses: Records, index: MapIndex, x: float) -> float:
    """Return the value of the pose at an abscissa of the map, 0 where there is none."""
    near = np.abs(poses["x"] + index.origin[0] - x) < 0.1
    return float(poses["value"][near].max(initial=0.0))


def windowed(window: HardPrior, index: MapIndex, scan: Scan) -> tuple[Candidates, Candidates]:
    """Return what is found with a window and what without."""
    return found(index, scan, prior=window), found(index, scan)


def test_a_window_is_searched_by_itself_and_then_the_whole_map() -> None:
    window = HardPrior(pose(3.2, 2.5, 0.7), 0.5, 0.3)
    both, anywhere = windowed(window, ROOM_INDEX, ROOM_SCAN)
    within = both.poses[: len(both.poses) - len(anywhere.poses)]
    np.testing.assert_array_equal(both.poses[len(within) :], anywhere.poses)
    assert len(within) > 0
    x, y = ROOM_INDEX.origin
    assert (np.hypot(within["x"] + x - 3.2, within["y"] + y - 2.5) <= 0.5).all()


def test_both_searches_of_a_window_are_counted() -> None:
    """The one in the window ends after fewer hypotheses, and so many bases as there are at most."""
    window = HardPrior(pose(3.2, 2.5, 0.7), 0.5, 0.3)
    both, anywhere = (one.report for one in windowed(window, ROOM_INDEX, ROOM_SCAN))
    assert both.complete
    for name in ("bases", "hypotheses", "verified"):
        more = getattr(both, name) - getattr(anywhere, name)
        assert 0 < more <= len(bases_in(ROOM_INDEX, ROOM_SCAN)) * (1 if name == "bases" else 10), name


def test_a_search_of_a_window_is_as_sure_as_the_less_sure_one() -> None:
    """In a window where nothing lies all bases are gone through; elsewhere the search ends before."""
    nowhere = HardPrior(pose(-40.0, 0.0, 0.0), 0.1, 0.1)
    anywhere = found(MAZE_INDEX, MAZE_SCAN, confidence=0.8).report
    assert 0.8 <= anywhere.confidence < 1.0
    assert not anywhere.exhaustive
    both = found(MAZE_INDEX, MAZE_SCAN, prior=nowhere, confidence=0.8).report
    assert both.bases == anywhere.bases + len(bases_in(MAZE_INDEX, MAZE_SCAN))
    assert (both.exhaustive, both.confidence) == (False, anywhere.confidence)
    exhaustive = found(MAZE_INDEX, MAZE_SCAN, prior=nowhere, exhaustive=True).report
    assert (exhaustive.exhaustive, exhaustive.confidence) == (True, 1.0)


def deadlines() -> Iterator[Deadline]:
    """Yield deadlines that are ever later, until the search is complete in one."""
    milliseconds = itertools.accumulate(itertools.count(0))
    return (Deadline(time.monotonic() + 1e-3 * ms) for ms in milliseconds)


@pytest.mark.parametrize("prior", [None, HardPrior(pose(3.2, 2.5, 0.7), 0.5, 0.3)])
def test_a_stopped_search_says_so(prior: HardPrior | None) -> None:
    """Wherever the deadline ends it: a search of a window comes first, and is complete when both are."""
    whole, reports = found(CAMPUS, ROOM_SCAN, prior=prior, exhaustive=True), []
    for deadline in deadlines():
        candidates = found(CAMPUS, ROOM_SCAN, prior=prior, exhaustive=True, deadline=deadline)
        reports.append(candidates.report)
        if candidates.report.complete:
            break
        assert not candidates.report.exhaustive
        assert candidates.report.complete_above == 1.0
        assert candidates.report.hypotheses <= whole.report.hypotheses
        assert (np.diff(candidates.poses["value"]) <= 0.0).all() or prior is not None
    assert (reports[0].bases, reports[0].hypotheses, reports[0].confidence) == (0, 0, 0.0)
    assert reports[-1] == whole.report
    assert (reports[-1].exhaustive, reports[-1].complete_above) == (True, RIVAL_SHARE)
    np.testing.assert_array_equal(candidates.poses, whole.poses)


def test_a_cancelled_search_raises() -> None:
    for prior in (None, HardPrior(INSIDE, 0.5, 0.3)):
        deadline = Deadline()
        deadline.cancel()
        with pytest.raises(CancelledError):
            found(ROOM_INDEX, ROOM_SCAN, prior=prior, deadline=deadline)


@pytest.mark.parametrize("seen_walls", [[[-3, 1, 3, 1], [3, -1, -3, -1]], [[-3, 1, 3, 1], [3, 1, 3, -2]]])
def test_a_deadline_holds_where_walls_are_kilometres_long(seen_walls: list[list[float]]) -> None:
    """Some hundred of them offer a million slides, and each crossing wall thousands of bases."""
    along, far, none = np.linspace(0.0, 9000.0, 300), np.full(300, 9999.0), np.zeros(300)
    index = index_of(np.vstack([np.stack([none, along, far, along], 1), np.stack([along, none, along, far], 1)]))
    found(index, scan_of(seen_walls), deadline=Deadline(at=time.monotonic()))
    begun = time.thread_time()  # what others take of the processor does not count
    report = found(index, scan_of(seen_walls), deadline=Deadline(at=time.monotonic() + 0.1)).report
    assert time.thread_time() - begun < 1.0
    assert not report.complete
