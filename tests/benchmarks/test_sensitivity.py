"""Thresholds are found, moved and put back; what changes is counted."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

import association
from association import AssociationOptions, MapIndex, Scan
from association.scan import tuning as scan_tuning
from association.scan.scan_lines import gates
from association.verdict import probabilities, tuning
from benchmarks import threshold_effects
from benchmarks.compiled_thresholds import dependent_kernels
from benchmarks.examples import Case
from benchmarks.sensitivity import effects
from benchmarks.threshold_effects import Effect, Sampled, Told, effect_of
from benchmarks.thresholds import Threshold, moved, readers, thresholds
from registration import MeasuredSegments, RigidTransform, Segments

ROOM = np.array([[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]], float)
HERE = RigidTransform(1.0, 1.0, 0.5)
MOST = 283  # thresholds; fewer from time to time, and never more


def named(name: str) -> Threshold:
    return next(one for one in thresholds() if one.name == name)


def in_room() -> Sampled:
    """Return a scan of all walls of a room."""
    seen = Segments.from_array(HERE.inverse().apply(ROOM.reshape(-1, 2, 2)).reshape(-1, 4))
    scan = Scan(MeasuredSegments.from_segments(seen, 0.02))
    return Sampled(Case(scan, MapIndex.build(Segments.from_array(ROOM)), HERE, 0.1, 1.0, "g", "c", "f"), None, 0)


def test_the_thresholds_of_all_stages_are_found() -> None:
    found = thresholds()
    files = {Path(*one.module.split(".")) for one in found}
    root = Path(association.__file__).parents[1]
    assert files == {path.relative_to(root).with_suffix("") for path in (root / "association").rglob("tuning.py")}
    assert len(found) <= MOST
    assert (named("MANY").compiled, named("USABLE_CAUTIOUS").compiled) == (True, False)
    assert named("NULL_FRACTIONS").value == tuning.NULL_FRACTIONS
    assert named("UNLIKE_SYMMETRY").value == tuning.UNLIKE_SYMMETRY


@pytest.mark.parametrize(
    ("value", "less", "more"),
    [(0.5, 0.4, 0.6), (10, 8, 12), (2, 1, 3), (-9.0, -7.2, -10.8), ((1.0, 10), (0.8, 8), (1.2, 12))],
)
def test_a_threshold_moves_by_a_fifth(value: float, less: float, more: float) -> None:
    """An integer by one at least."""
    one = Threshold("module", "NAME", value, False)
    assert one.moved(0.8) == pytest.approx(less)
    assert one.moved(1.2) == pytest.approx(more)


def test_every_reader_sees_the_moved_value_and_the_former_one_afterwards() -> None:
    one, before = named("USABLE_CAUTIOUS"), tuning.USABLE_CAUTIOUS
    assert probabilities in readers(one.name)
    with moved(one, 0.5):
        assert {vars(module)[one.name] for module in (*readers(one.name), tuning)} == {0.5}
    assert {vars(module)[one.name] for module in (*readers(one.name), tuning)} == {before}


def test_the_sample_has_scans_with_and_without_ranges() -> None:
    drawn = list(islice(threshold_effects.draw(), 12))
    assert {one.with_beams for one in drawn} == {False, True}
    assert [one.number for one in drawn] == list(range(12))
    assert any(one.prior is not None for one in drawn)
    again = threshold_effects.sample_of([3, 7])
    assert [one.number for one in again] == [3, 7]
    assert again[0].case.group == drawn[3].case.group


@pytest.mark.long
def test_what_is_cached_or_derived_moves_too() -> None:
    before = gates(AssociationOptions())
    with moved(named("LEAST_OFFSET_GATE"), 1.0):
        assert gates(AssociationOptions()) != before
    assert gates(AssociationOptions()) == before
    with moved(named("LINE_ANGLE"), 0.5):
        assert math.cos(0.5) == scan_tuning.LINE_COSINE
    assert math.cos(scan_tuning.LINE_ANGLE) == scan_tuning.LINE_COSINE
    assert "LINE_COSINE" not in {one.name for one in thresholds()}, "it is no threshold of its own"


def test_a_threshold_that_decides_changes_answers_and_one_for_work_does_not() -> None:
    some = [in_room()]
    assert some[0].answer().usable
    assert some[0].answer(index_again=True) == some[0].answer()
    strict, idle = replace(named("USABLE_CAUTIOUS"), value=0.9), named("RANKED_AT_ONCE")
    found = dict(effects(some, [strict, idle]))
    less, more = found[strict]
    assert (less.changed, less.usable) == (0, 0)
    assert (more.changed, more.usable, more.right, more.wrong) == (1, -1, 0, 0)
    assert [one.changed for one in found[idle]] == [0, 0]


def test_a_value_that_is_not_possible_is_reported() -> None:
    ((_, both),) = effects([in_room()], [Threshold("association.verdict.tuning", "USABLE_CAUTIOUS", (0.9, 0.9), False)])
    assert all(one.failed.startswith("TypeError") for one in both)
    assert in_room().answer().usable, "the former value is back"


def test_changes_are_counted() -> None:
    right = Told("ok", True, HERE, 0.99, True)
    wrong = replace(right, pose=RigidTransform(9.0, 9.0, 0.0), right=False)
    refused = replace(right, status="ambiguous", usable=False)
    nearly = replace(right, pose=RigidTransform(HERE.x + 1e-9, HERE.y, HERE.theta))
    none = Told("no_match", False, None, 0.0, False)
    before, after = [right, right, right, right, refused], [nearly, wrong, refused, none, right]
    assert effect_of(before, after, 1.5) == Effect(4, -2, -1, 1, 1.5)


def test_the_kernels_that_depend_on_a_threshold_are_found_through_their_calls() -> None:
    found = dependent_kernels("UNCOUNTED_FRACTION")
    assert "alternatives.compare" in found
    assert "odds.logistic" not in found
    assert {"features.describe", "null_features.write_null_features"} & dependent_kernels("MOST_NULL")
    assert dependent_kernels("NO_SUCH_THRESHOLD") == set()
