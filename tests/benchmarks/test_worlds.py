"""Drawn worlds are asked, recorded and judged as the table says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from association import Status
from benchmarks.worlds import draw_case
from benchmarks.worlds.measured.goals import BEFORE, rows
from benchmarks.worlds.measured.outcomes import WorldOutcome, answer, share_read
from benchmarks.worlds.measured.questions import FORMS, question
from benchmarks.worlds.measured.tables import could_be_told, held
from registration import RigidTransform

ANSWER = WorldOutcome(
    world="museum", condition="clean", number=0, held_out=True, form="ranges", truth=[0.0, 0.0, 0.0],
    pose=[0.1, 0.0, 0.0], status="ok", usable=True, reasons=[], probability=0.99, distance=0.1, angle=0.0, read=1.0,
    covariance=[1.0, 0.0, 0.0, 1.0, 0.0, 1.0], nees=3.0, walls=7, matched=9, missing=0, scan_segments=9,
    map_segments=100, inlier_fraction=0.9, score=100.0, runner_up=None, margin=None, chi2=20.0,
    reliability=0.5, dof=18, alternatives=0, complete=True, milliseconds=1.0,
)  # fmt: skip
WRONG = replace(ANSWER, pose=[5.0, 0.0, 0.0], distance=5.0, read=0.5, nees=900.0)
AWAY = replace(WRONG, condition="sister", truth=None, distance=None, angle=None, nees=None)


def judged(outcomes: list[WorldOutcome], what: str) -> str:
    (row,) = [row for row in rows(outcomes, "reporting") if row.what.startswith(what)]
    return row.measured


def test_both_forms_are_of_one_scan_and_the_segments_come_without_beams() -> None:
    case = draw_case("hotel", "clean", 0)
    asked = question(case)
    assert set(asked.scans) == set(FORMS)
    ranges, segments = asked.scans["ranges"], asked.scans["segments"]
    assert ranges.beams is not None
    assert segments.beams is None
    np.testing.assert_array_equal(ranges.measured.segments.endpoints, segments.measured.segments.endpoints)
    assert (segments.measured.sigma == case.scanner.sigma).all()
    assert asked.prior is None
    window = draw_case("hotel", "window", 0).window
    prior = question(draw_case("hotel", "window", 0)).prior
    assert prior is not None
    assert prior.pose == window.pose
    assert prior.radius == window.radius


def test_an_answer_is_held_against_the_truth() -> None:
    asked = question(draw_case("factory", "clean", 0))
    for form in FORMS:
        found = answer(asked, form)
        assert found.status == Status.OK
        assert found.right
        assert found.fine
        assert not found.wrong
        assert found.read > 0.98
        assert found.nees < 30.0
        assert 2 <= found.walls <= found.matched
    moved = replace(asked.case, truth=RigidTransform(asked.case.truth.x + 0.2, asked.case.truth.y, 0.0))
    moved = replace(moved, truth=replace(moved.truth, theta=asked.case.truth.theta))
    off = answer(replace(asked, case=moved), "ranges")
    assert off.right
    assert not off.fine
    assert off.distance == pytest.approx(0.2, abs=0.05)


def test_beams_tell_where_a_scan_was_not_taken() -> None:
    case = draw_case("hospital", "clean", 2)
    assert share_read(case, case.truth) > 0.99
    beside = replace(case.truth, x=case.truth.x + 0.5)
    assert share_read(case, beside) < 0.6
    # Half of the beams read 1 m too short, one in four is not known.
    ranges = case.ranges.copy()
    ranges[::2] -= 1.0
    ranges[1::4] = np.nan
    assert share_read(replace(case, ranges=ranges), case.truth) == pytest.approx(1.0 / 3.0, abs=0.04)


def test_wrong_answers_and_strangers_are_counted() -> None:
    found = (
        [replace(WRONG, world="school", held_out=False)] * 50
        + [ANSWER] * 8
        + [WRONG] * 2
        + [replace(o, usable=False, status="ambiguous") for o in (ANSWER, WRONG)] * 5
    )
    assert judged(found, "ranges: in the map: usable but wrong") == "20.00 (2 of 10)"
    assert judged(found, "ranges:   in the worst world, museum") == "20.00 (2 of 10)"
    before = BEFORE["reporting"]["clean"][0]
    assert judged(found, "ranges: clean") == f"{4000.0 / before:.1f} (40.0 of {before:.1f} % of the scans)"
    away = [AWAY] * 3 + [replace(AWAY, read=0.99)] + [replace(AWAY, usable=False, status="no_match", pose=None)] * 4
    assert judged(away, "ranges: sister") == "37.50"
    away[-1] = replace(AWAY, usable=False, status="ambiguous", reasons=["similar_place", "not_on_map"])
    away[-2] = replace(AWAY, usable=False, status="ambiguous", reasons=["similar_place"])
    assert judged(away, "ranges: in another building: told to be elsewhere") == "37.5"
    assert judged(away, "ranges: mirrored") == "not measured"
    assert judged([replace(ANSWER, form="segments", condition="turning")] * 2, "segments: turning") == "100.0"
    assert could_be_told(AWAY)
    assert not could_be_told(replace(AWAY, read=0.98))


def test_equal_units_are_counted_and_new_kinds_are_not_compared_with_former_figures() -> None:
    flats = [replace(one, world="mirrored_flats") for one in (ANSWER, ANSWER, ANSWER, WRONG)]
    terraces = [replace(WRONG, world="terraces")] * 4
    assert judged([*flats, *terraces, ANSWER], "ranges:   in buildings of equal units") == "62.50 (5 of 8)"
    assert judged([*flats, *terraces], "ranges: clean") == judged(flats, "ranges: clean")


def test_covariances_are_judged_by_right_answers_of_many_and_of_few_walls() -> None:
    found = [ANSWER] * 18 + [replace(ANSWER, nees=9.0)] * 2 + [WRONG] * 5
    found += [replace(ANSWER, walls=2, nees=1.0)] * 20
    assert judged(found, "ranges: 6 walls and more: truths") == "90.0"
    assert judged(found, "ranges: 6 walls and more: mean NEES") == "3.60"
    assert judged(found, "ranges: fewer than 6 walls: truths") == "100.0"
    assert held(replace(ANSWER, nees=7.8))
    assert not held(replace(ANSWER, nees=7.9))
