"""A change that makes the map worse for the scans that it came from is found out."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import replace
from typing import TypeVar

import numpy as np
import pytest

from association import Deadline, MapIndex, Reason, ReasonCode
from map_quality import VisitScan
from map_quality.update.beams import Chunks, sees
from map_quality.update.evidence import Gatherer
from map_quality.update.scans import Localized, is_vouched, on_map, search
from map_quality.update.verifying import blamed, is_better, keeps_usable
from map_quality.update.walls import Draft
from registration import Segments

from .hall import PILLAR, RACK, segments, visit

HALL, EMPTY = segments(RACK, PILLAR), segments(PILLAR)
NOTHING = np.zeros((0, 4))
T = TypeVar("T")


def done(steps: Generator[None, None, T]) -> T:
    while True:
        try:
            next(steps)
        except StopIteration as ended:
            found: T = ended.value
            return found


def localized(on: Segments, today: Segments) -> list[Localized]:
    index, scans = MapIndex.build(on, 0.005), [one for k in range(2) for one in visit(today, f"day {k}", k)]
    found = [(one, search(index, one, Deadline())) for one in scans]
    return [Localized(k, k // 8, one, result, on, False) for k, (one, result) in enumerate(found)]


@pytest.mark.parametrize(("today", "better"), [(EMPTY, True), (HALL, False)])
def test_the_removal_of_a_rack_is_better_only_if_it_is_gone(today: Segments, better: bool) -> None:
    first, after = localized(HALL, today), localized(EMPTY, today)
    chosen = [one for one in first if one.precise]
    evidence = done(Gatherer(HALL, 0.005, True, Deadline()).gather(Segments.derived(NOTHING), chosen))
    rack = np.arange(evidence.chunks.first[12], evidence.chunks.first[16])
    draft = Draft("removed", (12, 13, 14, 15), NOTHING, np.zeros(0), rack, rack[:0])
    assert len(evidence.scans_of(evidence.rows_of(rack))) > 5
    assert is_better(draft, evidence, first, after) is better


def test_a_map_on_which_many_scans_fit_less_is_withdrawn() -> None:
    first = localized(HALL, HALL)
    assert keeps_usable(first, first)
    worse = localized(Segments.derived(HALL.endpoints[[0, 1, 6, 10]]), HALL)
    assert sum(one.usable for one in worse) < sum(one.usable for one in first) - 2
    assert not keeps_usable(first, worse)
    assert keeps_usable(worse, first)


def test_the_changes_that_lost_scans_see_are_blamed_and_no_others() -> None:
    seen = np.array([[1, 1, 0, 0], [0, 0, 0, 0], [1, 1, 1, 0], [0, 0, 0, 1]], dtype=bool)
    assert blamed(seen, 0.0) == [2, 3]
    assert blamed(seen, 1.0) == [2]
    assert blamed(seen, 4.0) == []
    assert blamed(seen[1:2], 0.0) == []  # no change is to blame


def test_a_scan_sees_a_wall_if_a_beam_meets_it() -> None:
    (one, *_) = localized(HALL, HALL)
    assert one.usable
    outline, rack = (Chunks.of(Segments.derived(HALL.endpoints[rows])) for rows in (slice(0, 12), [12]))
    behind = Chunks.of(Segments.from_array(np.array([[13.5, 2.0, 13.5, 3.0]])))
    assert sees(outline, one, 0.005, Deadline())
    assert sees(rack, one, 0.005, Deadline())
    assert not sees(behind, one, 0.005, Deadline())
    lost = replace(one, result=replace(one.result, covariance=None))
    assert sees(behind, lost, 0.005, Deadline()), "it may be anywhere"


@pytest.mark.parametrize(
    ("codes", "vouched"),
    [(("single_wall",), True), (("map_mismatch", "single_wall"), True), (("similar_place",), False)],
)
def test_a_pose_of_the_sender_confirms_one_that_an_old_map_makes_unusable(
    codes: tuple[ReasonCode, ...], vouched: bool
) -> None:
    (one, *_) = localized(HALL, HALL)
    result = replace(one.result, usable=False, reasons=tuple(Reason(code, "") for code in codes))
    for away, confirmed in ((0.1, vouched), (2.0, False)):
        pose = replace(one.pose, x=one.pose.x + away)
        sent = VisitScan(one.scan, "day 0", pose, np.diag([0.04, 0.04, math.radians(6.0) ** 2]))
        assert is_vouched(sent, result) is confirmed
    assert not is_vouched(VisitScan(one.scan, "day 0"), result)


def test_correspondences_go_over_to_another_map_with_the_same_walls() -> None:
    one = localized(HALL, HALL)[0]
    old = MapIndex.build(HALL, 0.005)
    one = replace(one, on=old.segments)
    gone = one.result.correspondences[-1].map
    kept = np.delete(np.arange(len(HALL)), gone)[::-1]
    new = MapIndex.build(Segments.from_array(HALL.endpoints[kept]), 0.005)
    (moved,) = on_map([one], old, new, kept)
    pairs = [pair for pair in one.result.correspondences if pair.map != gone]
    assert [(pair.scan, kept[pair.map]) for pair in moved.result.correspondences] == [
        (pair.scan, pair.map) for pair in pairs
    ]
    assert moved.on is new.segments
