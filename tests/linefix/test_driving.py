"""The last view of a drive, where the drive as a whole is not usable."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import association
import linefix
from association import (
    AnswerExplanation,
    AssociationResult,
    AssociationWarning,
    HardPrior,
    KnownOfMaps,
    MapIndex,
    Reason,
    Scan,
    View,
    assemble,
)
from linefix.driving import (
    AGREED_ANGLE,
    AGREED_DISTANCE,
    AGREED_PROBABILITY,
    LAST_VIEW_ONLY,
    last_view,
    search,
    search_drive,
)
from registration import Beams, MeasuredSegments, RigidTransform, Segments
from tests.association.scenes import known

CORNERS = np.array([[0, 0], [9, 0], [9, 4], [5, 4], [5, 7], [2, 7], [2, 5.5], [0, 5.5]])
ROOM = np.hstack([CORNERS, np.roll(CORNERS, -1, axis=0)])
INDEX = linefix.index_map(ROOM)
INSIDE = RigidTransform(3.0, 2.5, 0.7)
STEP = np.diag([0.02**2, 0.02**2, 0.02**2])
ANGLES = np.linspace(-math.pi, math.pi, 240, endpoint=False)


def look(at: RigidTransform, *, clutter: int = 0, seed: int = 5, with_beams: bool = False) -> Scan:
    """Return what is seen of ROOM, and of things that are on no map, from next to INSIDE."""
    rng, there = np.random.default_rng(seed), INSIDE.compose(at)
    begins = np.array([there.x, there.y]) + rng.uniform(-6.0, 6.0, (clutter, 2))
    things = np.hstack([begins, begins + rng.uniform(-1.5, 1.5, (clutter, 2))])
    ends = there.inverse().apply(np.vstack([ROOM, things]).reshape(-1, 2, 2)).reshape(-1, 4)
    measured = MeasuredSegments.from_segments(Segments.from_array(ends + rng.normal(0.0, 0.003, ends.shape)))
    beams = Beams(ANGLES, np.full(len(ANGLES), 1.0), 20.0) if with_beams else None
    return Scan(measured, (0.0, 0.0), beams)


def drive(clutter: int = 12, *, with_beams: bool = False) -> list[View]:
    """Return a drive to INSIDE, the latest view first; the others see so many things that are on no map."""
    views = [View(look(RigidTransform(0, 0, 0), with_beams=with_beams))]
    for k in range(1, 4):
        at = RigidTransform(-0.4 * k, 0.1 * k, 0.1 * k)
        views.append(View(look(at, clutter=clutter, seed=7 + k, with_beams=with_beams), at, STEP, k - 1))
    return views


WHOLE, FIRST = assemble(drive()), drive()[0].scan


def judged(scan: Scan, result: AssociationResult) -> AssociationResult:
    """Return an answer with the verdict of these tests: a drive is likely and not usable, anything else usable.

    Whatever the model makes of it: that is another test's matter.
    """
    if scan.views is not None and scan.views.uncertain:
        return replace(result, usable=False, probability=0.9)
    return replace(result, usable=True, probability=0.99, reasons=())


DRIVE = judged(WHOLE, association.associate(INDEX, WHOLE))
ALONE = judged(FIRST, association.associate(INDEX, FIRST))


@pytest.fixture
def _judged(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let searches have the verdict of these tests."""
    associate, on_maps, explain = association.associate, association.associate_on_maps, association.explain_verdict

    def explained(index: MapIndex, scan: Scan, *others: Any) -> AnswerExplanation:
        found = explain(index, scan, *others)
        return replace(found, result=judged(scan, found.result))

    monkeypatch.setattr(association, "associate", lambda on, scan, *others: judged(scan, associate(on, scan, *others)))
    monkeypatch.setattr(
        association, "associate_on_maps", lambda on, scan, *others: judged(scan, on_maps(on, scan, *others))
    )
    monkeypatch.setattr(association, "explain_verdict", explained)


def codes(result: AssociationResult) -> list[str]:
    return [one.code for one in result.warnings]


def answered(drive: AssociationResult = DRIVE, alone: AssociationResult = ALONE) -> AssociationResult:
    """Return the answer where the drive and its last view come to these."""
    return search_drive(lambda scan: drive if scan is WHOLE else alone, WHOLE)


def counting(searched: list[Scan]) -> Callable[[Scan], AssociationResult]:
    """Return a search that lists what is searched, and finds nothing usable."""

    def search(scan: Scan) -> AssociationResult:
        searched.append(scan)
        return DRIVE

    return search


@pytest.mark.usefixtures("_judged")
def test_the_last_view_answers_for_a_drive_that_is_not_usable() -> None:
    assert (DRIVE.usable, ALONE.usable) == (False, True)
    pose = known(ALONE.pose)
    for answer in (linefix.locate, lambda *asked: linefix.explain(*asked).result):
        found = answer(INDEX, WHOLE)
        assert (found.status, found.usable, found.reasons) == (ALONE.status, True, ())
        assert found.probability == pytest.approx(ALONE.probability, abs=1e-9)
        assert (known(found.pose).x, known(found.pose).y) == pytest.approx((pose.x, pose.y), abs=1e-9)
        assert codes(found)[-1] == LAST_VIEW_ONLY.code
    assert LAST_VIEW_ONLY.code not in codes(ALONE)
    explained = linefix.explain(INDEX, WHOLE)
    assert explained.verdict != known(explained.last_view)
    assert linefix.explain(INDEX, FIRST).last_view is None


@pytest.mark.usefixtures("_judged")
def test_on_several_maps_too() -> None:
    maps = linefix.index_maps({"room": ROOM, "hall": ROOM[:4] * [2.0, 3.0, 2.0, 3.0]})
    for beforehand in (KnownOfMaps(), KnownOfMaps(HardPrior(INSIDE, 0.5, 0.5), "room")):
        found = search(maps, WHOLE, beforehand)
        assert (found.usable, found.map_id, codes(found)[-1]) == (True, "room", LAST_VIEW_ONLY.code)
    assert codes(linefix.locate(maps, WHOLE))[-1] == LAST_VIEW_ONLY.code


def latest_last() -> tuple[Scan, int]:
    """Return the drive with the latest view at the end, and the number of segments before it."""
    first, *others = drive()
    views = [*(replace(one, relative_to=3) for one in others), first]
    return assemble(views), sum(len(one.scan.measured) for one in others)


@pytest.mark.usefixtures("_judged")
def test_its_indices_are_those_of_the_drive() -> None:
    """Wherever among the views it is; the segments of the others are unmatched."""
    whole, before = latest_last()
    found = linefix.locate(INDEX, whole)
    assert LAST_VIEW_ONLY.code in codes(found)
    expected = [(pair.scan + before, pair.map) for pair in ALONE.correspondences]
    assert [(pair.scan, pair.map) for pair in found.correspondences] == expected
    assert list(found.unmatched_scan) == [*range(before), *(k + before for k in ALONE.unmatched_scan)]


def test_a_critical_wall_has_the_indices_of_the_drive() -> None:
    wall = association.CriticalWall((0, 2), (5,), (1.0, 0.0), 0.2)
    alone = replace(ALONE, diagnostics=replace(known(ALONE.diagnostics), critical_wall=wall))
    whole, before = latest_last()
    found = search_drive(lambda scan: DRIVE if scan is whole else alone, whole)
    assert known(found.diagnostics).critical_wall == replace(wall, scan=(before, before + 2))


def moved(distance: float = 0.0, angle: float = 0.0) -> RigidTransform:
    at = known(ALONE.pose)
    return RigidTransform(at.x + distance * AGREED_DISTANCE, at.y, at.theta - angle * AGREED_ANGLE)


@pytest.mark.parametrize(
    ("changes", "usable"),
    [
        ({"probability": AGREED_PROBABILITY}, True),
        ({"probability": AGREED_PROBABILITY - 1e-9}, False),
        ({"probability": None}, False),
        ({"pose": None}, False),
        *(({"pose": moved(**{by: part})}, abs(part) < 1.0)
          for by in ("distance", "angle") for part in (-1.1, -0.95, 0.95, 1.1)),
        ({"map_id": "another"}, False),
        ({"reasons": (Reason("prior_contradicted", ""),)}, False),
        ({"reasons": (Reason("map_mismatch", ""),)}, True),
    ],
    ids=str,
)  # fmt: skip
def test_a_drive_that_is_evidence_against_the_pose_is_not_answered(changes: dict[str, Any], usable: bool) -> None:
    assert answered(drive=replace(DRIVE, **changes)).usable is usable


def test_a_drive_that_is_usable_is_searched_once_and_one_of_no_usable_view_stays_as_it_is() -> None:
    usable = replace(DRIVE, usable=True)
    assert answered(drive=usable) is usable
    assert answered(alone=replace(ALONE, usable=False)) is DRIVE


@pytest.mark.usefixtures("_judged")
def test_a_prior_that_the_drive_contradicts_is_not_answered() -> None:
    elsewhere = HardPrior(RigidTransform(7.5, 2.0, INSIDE.theta), 0.5, 0.5)
    assert not linefix.locate(INDEX, WHOLE, prior=elsewhere).usable
    maps = linefix.index_maps({"room": ROOM, "hall": ROOM[:4] * [2.0, 3.0, 2.0, 3.0]})
    assert not search(maps, WHOLE, KnownOfMaps(elsewhere, "room")).usable
    assert linefix.locate(INDEX, WHOLE, prior=HardPrior(INSIDE, 0.5, 0.5)).usable


def test_a_last_view_that_is_not_searched_to_the_end_leaves_the_answer_incomplete() -> None:
    """The drive was searched to the end, but with more time its answer would have been another."""
    cut = Reason("search_incomplete", "why"), AssociationWarning("search_incomplete", "so")
    alone = replace(ALONE, usable=False, search=ALONE.search.cut_short(), reasons=cut[:1], warnings=cut[1:])
    assert DRIVE.search.complete
    found = answered(alone=alone)
    assert (found.usable, found.search.complete, found.search.complete_above) == (False, False, 1.0)
    assert (found.reasons, found.warnings) == ((cut[0], *DRIVE.reasons), (*DRIVE.warnings, cut[1]))
    late = replace(DRIVE, search=DRIVE.search.cut_short())
    assert answered(drive=late, alone=alone) is late


def test_warnings_about_the_scan_of_the_drive_stay() -> None:
    """Those about its pose do not."""
    told = tuple(AssociationWarning(code, "") for code in ("faces_away", "map_scale", "motion_unknown"))
    found = answered(drive=replace(DRIVE, warnings=told), alone=replace(ALONE, warnings=told[:1]))
    assert codes(found) == ["faces_away", "motion_unknown", LAST_VIEW_ONLY.code]


def test_nothing_else_is_searched_where_there_is_no_last_view() -> None:
    """Of one scan, of several exact sensors, of views that are all uncertain, and where the last view is empty."""
    exact = [replace(one, covariance=None, relative_to=None) for one in drive()]
    every = [replace(one, covariance=STEP) for one in drive()]
    empty = [View(Scan(MeasuredSegments.from_segments(Segments.from_array(())))), *drive()[1:]]
    for scan in (look(RigidTransform(0, 0, 0), clutter=30), assemble(exact), assemble(every), assemble(empty)):
        searched: list[Scan] = []
        assert last_view(scan) is None
        assert search_drive(counting(searched), scan) is DRIVE
        assert len(searched) == 1


@pytest.mark.parametrize("with_beams", [False, True])
def test_the_last_view_is_the_scan_that_was_sent(with_beams: bool) -> None:
    views = drive(with_beams=with_beams)
    found, sent = last_view(assemble(views)), views[0].scan
    assert found is not None
    assert found.own.tolist() == list(range(len(sent.measured)))
    np.testing.assert_allclose(found.scan.measured.segments.endpoints, sent.measured.segments.endpoints, atol=1e-12)
    np.testing.assert_array_equal(found.scan.measured.point_counts, sent.measured.point_counts)
    assert found.scan.views is None
    assert found.scan.viewpoint == pytest.approx(sent.viewpoint)
    assert (found.scan.beams is None) is not with_beams
    if found.scan.beams is not None and sent.beams is not None:
        np.testing.assert_allclose(found.scan.beams.angles, sent.beams.angles, atol=1e-12)
        np.testing.assert_array_equal(found.scan.beams.ranges, sent.beams.ranges)
        assert found.scan.beams.origins is None


@pytest.mark.parametrize("with_beams", [False, True])
def test_several_sensors_at_the_last_place_are_one_view(with_beams: bool) -> None:
    """Each with a mount of its own, which is exact."""
    mounts = (RigidTransform(0.3, 0.2, 0.8), RigidTransform(-0.3, -0.1, -2.0))
    here = [View(look(at, with_beams=with_beams), at) for at in mounts]
    before = [replace(one, relative_to=None) for one in drive(with_beams=with_beams)[1:]]
    found = known(last_view(assemble([here[0], *before, here[1]])))
    assert found.scan.views is not None
    assert (len(found.scan.views), found.scan.views.uncertain) == (2, False)
    counts = [len(one.scan.measured) for one in (here[0], *before, here[1])]
    assert found.own.tolist() == [*range(counts[0]), *range(sum(counts) - counts[-1], sum(counts))]
    both = assemble(here)
    assert both.views is not None
    np.testing.assert_allclose(found.scan.measured.segments.endpoints, both.measured.segments.endpoints, atol=1e-12)
    np.testing.assert_array_equal(found.scan.views.of_segment, both.views.of_segment)
    np.testing.assert_array_equal(found.scan.views.of_beam, both.views.of_beam)
