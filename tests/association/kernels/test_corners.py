"""The list of crossings has every pair of runs there is, and a base proposes the same poses by it as by walking."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings

from association import MapIndex
from association.candidates import find_candidates
from association.crossings import crossings_of, no_crossings
from association.grids import drawn_out
from association.kernels import planning
from association.kernels.corners import corner_of, corner_reach, count_fits, fitting, search_corner
from association.kernels.crossings import list_crossings
from association.kernels.proposing import base_tolerance, search_base
from association.layout import FOUND, PROGRESS, RULES, Corner, Question, record
from association.tuning import CROSSING_REACH, MIN_CROSSING, RIVAL_SHARE
from registration.layout import Records

from ..reference import crossings as twin
from ..scenes import context_of, scan_of
from .drawn import INDEX, SEEDS, drawn, in_pieces, listed, oblique, workspace_of

ALL = record(RULES, kept_share=0.0, distinct_distance=0.0, distinct_angle=0.0, rival_share=0.95)  # keep every pose


@given(SEEDS)
@settings(max_examples=12, deadline=None)
def test_all_crossings_are_listed(seed: int) -> None:
    rng = np.random.default_rng(seed)
    runs = (oblique, in_pieces)[seed % 2](rng).runs
    got, expected = crossings_of(runs), twin.crossings(runs.rows, CROSSING_REACH)
    assert got.reach == CROSSING_REACH
    assert len(got.rows) == len(expected)
    order = np.lexsort([got.rows["second"], got.rows["first"]])
    for row, (pair, angle, ends) in zip(got.rows[order].tolist(), sorted(expected), strict=True):
        assert row[:2] == pair
        assert row[2:] == pytest.approx((angle, *ends), abs=1e-4)


def test_more_crossings_than_are_wanted_are_not_listed() -> None:
    runs = oblique(np.random.default_rng(0)).runs
    grid, whole = drawn_out(runs, 5.0), len(twin.crossings(runs.rows, 5.0))
    assert list_crossings(runs.rows, grid, 5.0, whole)[0] == whole
    count, rows = list_crossings(runs.rows, grid, 5.0, whole - 1)
    assert (count, len(rows)) == (whole, 0)


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_a_corner_holds_all_that_fits(seed: int) -> None:
    """Brute force over the angles between two lines: however they are turned, the ends stay within what it says."""
    rng = np.random.default_rng(seed)
    scan = drawn(seed).scan
    scan["angle_variance"] *= 10.0 ** rng.uniform(0.0, 3.0, len(scan))
    gates = context_of(INDEX, scan_of(np.eye(4)), angle_tolerance=turned_by(seed)).gates[0]
    for i, j in itertools.permutations(range(min(6, len(scan))), 2):
        turn = math.remainder(scan["angle"][j] - scan["angle"][i], math.tau)
        if math.sin(turn) < 0.3:
            continue
        a, b = scan[i], scan[j]
        tolerance = base_tolerance(a, b, gates)
        corner = corner_of(a, b, tolerance)
        for gap in np.linspace(-tolerance, tolerance, 31):
            if math.sin(turn + gap) < MIN_CROSSING:
                continue
            ends = twin.ends_at(a, b, float(gap))
            assert corner.least_angle <= turn + gap <= corner.greatest_angle
            assert ends[0] <= corner.first_begin
            assert ends[1] >= corner.first_end
            assert ends[2] <= corner.second_begin
            assert ends[3] >= corner.second_end
            assert max(ends[0], -ends[1], ends[2], -ends[3]) <= corner_reach(corner)


def turned_by(seed: int) -> float | None:
    """Return the tolerance of angles: in one of three cases a wide one."""
    return 0.3 if seed % 3 == 0 else None


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_what_fits_is_found_in_blocks_of_blocks(seed: int) -> None:
    rng = np.random.default_rng(seed)
    crossings = crossings_of(in_pieces(rng).runs)
    row = crossings.rows[rng.integers(len(crossings.rows))]
    slack = rng.uniform(0.0, 3.0, 5)
    corner = (
        row["angle"] - 0.1 * slack[0], row["angle"] + 0.1, row["first_begin"] + slack[1], row["first_end"] - slack[2],
        row["second_begin"] + slack[3], row["second_end"] - slack[4],
    )  # fmt: skip
    expected = twin.fitting(crossings.rows, corner)
    assert expected
    out = np.full(len(expected) + 1, -1, np.int32)
    assert fitting(crossings, Corner(*map(float, corner)), out) == len(expected)
    assert out.tolist() == [*expected, -1]
    some = np.full(1, -1, np.int32)
    assert fitting(crossings, Corner(*map(float, corner)), some) == len(expected)
    assert some.tolist() == expected[:1]


def question_of(index: MapIndex, endpoints: object, seed: int) -> Question:
    return context_of(index, scan_of(endpoints), angle_tolerance=turned_by(seed)).question(ALL)


def proposed(
    search: object, index: MapIndex, question: Question, base: Records, budget: int = 10**9
) -> tuple[list[tuple[float, ...]], int, int]:
    """Return the poses that come of a base, sorted, how many were proposed, and by how many calls."""
    found, progress, calls = np.zeros(20_000, FOUND), record(PROGRESS, slide=-np.inf), 0
    work = workspace_of(question.scan, index)
    while progress["bases"][0] == 0:
        search(question, index.tables, base, found, progress[0], work, budget)  # type: ignore[operator]
        calls += 1
    assert progress["anchor"][0] == 0
    poses: list[tuple[float, ...]] = sorted((p["score"], p["x"], p["y"]) for p in found[: int(progress["count"][0])])
    return poses, int(progress["hypotheses"][0]), calls


@given(SEEDS)
@settings(max_examples=12, deadline=None)
def test_a_base_proposes_by_the_list_what_it_does_by_walking(seed: int) -> None:
    d = drawn(seed, radius=7.0)
    index = listed((INDEX, oblique(d.rng), in_pieces(d.rng))[seed % 3])
    question = question_of(index, d.endpoints, seed)
    bases = planning.plan_bases(question.scan, len(question.scan), index.runs, index.area)
    for base in bases:
        count_fits(question, index.crossings, base)
    some = bases[bases["fits"] >= 0]
    assert len(some) > 0
    for base in some[d.rng.permutation(len(some))[:8]]:
        walked, hypotheses, _ = proposed(search_base, index, question, base)
        poses, by_list, calls = proposed(search_corner, index, question, base)
        assert (by_list, calls) == (hypotheses, 1)
        assert by_list <= base["fits"]
        np.testing.assert_allclose(poses, walked, atol=1e-4)
        again, same, calls = proposed(search_corner, index, question, base, 1)
        assert (again, same) == (poses, by_list)
        assert calls > 1 or base["fits"] <= 1


@given(SEEDS)
@settings(max_examples=10, deadline=None)
def test_what_is_found_by_the_list_is_as_good_as_what_all_bases_give(seed: int) -> None:
    d = drawn(seed, radius=8.0, clutter=seed % 6)
    index, scan = listed((INDEX, oblique(d.rng))[seed % 2]), scan_of(d.endpoints)
    whole = find_candidates(context_of(index, scan, exhaustive=True))
    walked = find_candidates(context_of(replace(index, crossings=no_crossings()), scan, exhaustive=True))
    usual = find_candidates(context_of(index, scan))
    assert whole.report.exhaustive
    assert whole.report.bases == walked.report.bases
    assert whole.report.hypotheses == walked.report.hypotheses
    assert usual.report.complete
    assert usual.report.bases <= whole.report.bases
    best = whole.poses["value"].max(initial=0.0)
    for one in (walked, usual):
        assert one.poses["value"].max(initial=0.0) == pytest.approx(best, abs=0.05)
    rivals = whole.poses[whole.poses["value"] > (RIVAL_SHARE + 0.02) * best]
    for rival in rivals:
        near = np.hypot(usual.poses["x"] - rival["x"], usual.poses["y"] - rival["y"]) < 0.5
        assert near.any()
