"""A change that makes the map worse for the scans that it came from is found out."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from association import Deadline, MapIndex, Reason, ReasonCode
from map_quality import VisitScan
from map_quality.update.scans import Localized, is_vouched, search
from map_quality.update.verifying import is_better, keeps_usable
from registration import Segments

from .hall import PILLAR, RACK, segments, visit

HALL, EMPTY = segments(RACK, PILLAR), segments(PILLAR)


def localized(on: Segments, today: Segments) -> list[Localized]:
    index, scans = MapIndex.build(on, 0.005), [one for k in range(2) for one in visit(today, f"day {k}", k)]
    found = [(one, search(index, one, Deadline())) for one in scans]
    return [Localized(k // 8, one, result, False) for k, (one, result) in enumerate(found)]


@pytest.mark.parametrize(("today", "better"), [(EMPTY, True), (HALL, False)])
def test_the_removal_of_a_rack_is_better_only_if_it_is_gone(today: Segments, better: bool) -> None:
    first, after = localized(HALL, today), localized(EMPTY, today)
    assert is_better(np.ones(len(first), dtype=bool), first, after) is better
    assert is_better(np.zeros(len(first), dtype=bool), first, after)


def test_a_map_on_which_many_scans_fit_less_is_withdrawn() -> None:
    first = localized(HALL, HALL)
    assert keeps_usable(first, first)
    worse = localized(Segments.derived(HALL.endpoints[[0, 1, 6, 10]]), HALL)
    assert sum(one.usable for one in worse) < sum(one.usable for one in first) - 2
    assert not keeps_usable(first, worse)
    assert keeps_usable(worse, first)


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
