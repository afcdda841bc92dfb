"""The last view of a drive, where the drive as a whole is not usable."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from association.last_view import LAST_VIEW_ONLY, last_view, search_last_view

from association import AssociationOptions, AssociationResult, Deadline, HardPrior, Scan, View, assemble, associate
from association.context import SearchContext
from association.rank_and_estimate import search_and_rank
from association.tuning import AGREED_ANGLE, AGREED_CAUTIOUS, DISTINCT_DISTANCE
from association.verdict.alternatives import AmongAlternatives
from association.verdict.verdict import Verdict, judge
from registration import RigidTransform

from .scenes import INSIDE, ROOM, answer_of, beams_of, context_of, index_of, pose, pose_in, same_pose, scan_of, seen

INDEX = index_of(ROOM)
STEP = np.diag([0.02**2, 0.02**2, 0.02**2])


def look(at: RigidTransform, *, clutter: int = 0, seed: int = 5, with_beams: bool = False) -> Scan:
    """Return what is seen of ROOM, and of things that are on no map, from next to INSIDE."""
    there = INSIDE.compose(at)
    ends = seen(ROOM, there, noise=0.005, clutter=clutter, seed=seed)[0]
    return scan_of(ends, viewpoint=(0.0, 0.0), beams=beams_of(INDEX, there) if with_beams else None)


def drive(clutter: int = 12, count: int = 4, *, with_beams: bool = False) -> list[View]:
    """Return a drive to INSIDE, the latest view first; the others see so many things that are on no map."""
    views = [View(look(pose(), with_beams=with_beams))]
    for k in range(1, count):
        at = pose(-0.4 * k, 0.1 * k, 0.1 * k)
        views.append(View(look(at, clutter=clutter, seed=7 + k, with_beams=with_beams), at, STEP, k - 1))
    return views


def judged(views: list[View]) -> tuple[SearchContext, Verdict]:
    """Return what the drive as a whole comes to."""
    context = context_of(INDEX, assemble(views))
    return context, judge(context, search_and_rank(context))


def codes(result: AssociationResult) -> list[str]:
    return [one.code for one in result.warnings]


def test_the_last_view_answers_for_a_drive_that_is_not_usable() -> None:
    views = drive()
    assert not judged(views)[1].usable
    alone, found = answer_of(INDEX, views[0].scan), answer_of(INDEX, assemble(views))
    assert alone.usable
    assert (found.status, found.usable, found.reasons) == (alone.status, True, ())
    assert found.probability == pytest.approx(alone.probability, abs=1e-9)
    assert same_pose(pose_in(found), pose_in(alone), 1e-9, 1e-9)
    assert codes(found)[-1] == LAST_VIEW_ONLY.code
    assert LAST_VIEW_ONLY.code not in codes(alone)


def test_its_indices_are_those_of_the_drive() -> None:
    """Wherever among the views it is; what the others show is unmatched."""
    first, *others = drive()
    moved = [replace(one, relative_to=None if one.relative_to is None else 0) for one in others]
    views = [*(replace(one, relative_to=3) for one in moved), first]
    before = sum(len(one.scan.measured) for one in moved)
    alone, found = answer_of(INDEX, first.scan), answer_of(INDEX, assemble(views))
    assert LAST_VIEW_ONLY.code in codes(found)
    expected = [(pair.scan + before, pair.map) for pair in alone.correspondences]
    assert [(pair.scan, pair.map) for pair in found.correspondences] == expected
    left = [k + before for k in alone.unmatched_scan]
    assert list(found.unmatched_scan) == [*range(before), *left]
    assert found.diagnostics is not None
    assert alone.diagnostics is not None
    for one, other in ((found.diagnostics.critical_wall, alone.diagnostics.critical_wall),):
        assert (one is None) == (other is None)
        if one is not None and other is not None:
            assert one.scan == tuple(k + before for k in other.scan)


def test_a_drive_that_is_usable_is_answered_as_a_whole() -> None:
    views = drive(clutter=0)
    found = answer_of(INDEX, assemble(views))
    assert found.usable
    assert LAST_VIEW_ONLY.code not in codes(found)
    assert {pair.scan for pair in found.correspondences} - set(range(len(views[0].scan.measured)))


def test_a_drive_whose_best_pose_is_elsewhere_is_not_answered() -> None:
    context, verdict = judged(drive())
    assert verdict.pose is not None
    assert search_last_view(context, verdict).result is not None
    near, far = 0.95, 1.1
    for part, agreed in ((near, True), (far, False)):
        for moved in (
            RigidTransform(INSIDE.x + part * DISTINCT_DISTANCE, INSIDE.y, INSIDE.theta),
            RigidTransform(INSIDE.x, INSIDE.y, INSIDE.theta - part * AGREED_ANGLE),
        ):
            assert (search_last_view(context, replace(verdict, pose=moved)).result is not None) is agreed


def test_a_drive_that_speaks_against_the_pose_is_not_answered() -> None:
    """However sure the last view is: in a building like this one the views before it show that it is another."""
    context, verdict = judged(drive())
    for cautious, answered in ((AGREED_CAUTIOUS, True), (AGREED_CAUTIOUS - 1e-9, False)):
        assert verdict.probabilities is not None
        found = replace(verdict.probabilities, by_model=cautious, among=AmongAlternatives(1.0, 1.0, None))
        assert (search_last_view(context, replace(verdict, probabilities=found)).result is not None) is answered


def test_what_is_not_usable_alone_is_not_usable_as_a_drive() -> None:
    first, *others = drive()
    ends = first.scan.measured.segments.endpoints[:2]
    views = [View(scan_of(ends, viewpoint=(0.0, 0.0))), *others]
    assert not answer_of(INDEX, views[0].scan).usable
    found = answer_of(INDEX, assemble(views))
    assert not found.usable
    assert LAST_VIEW_ONLY.code not in codes(found)
    assert found.reasons


def test_the_prior_holds_for_both() -> None:
    """One with which the drive does not agree is contradicted, whatever the last view says."""
    elsewhere = HardPrior(pose(7.5, 2.0, INSIDE.theta), 0.5, 0.5)
    found = answer_of(INDEX, assemble(drive()), elsewhere)
    assert not found.usable
    assert LAST_VIEW_ONLY.code not in codes(found)
    near = answer_of(INDEX, assemble(drive()), HardPrior(INSIDE, 0.5, 0.5))
    assert near.usable


def test_a_deadline_that_ends_before_it_is_told() -> None:
    context, verdict = judged(drive())
    late = replace(context, deadline=Deadline(time.monotonic() - 1.0))
    last = search_last_view(late, verdict)
    assert (last.result, last.complete) == (None, False)
    cut = verdict.cut_short()
    assert (cut.usable, cut.complete, cut.reasons[0].code) == (False, False, "search_incomplete")
    assert cut.cut_short() is cut


def test_nothing_else_is_searched_where_there_is_no_last_view() -> None:
    """Of one scan, of several exact sensors, and of views that are all uncertain; the deadline does not matter."""
    exact = [replace(one, covariance=None, relative_to=None) for one in drive()]
    every = [replace(one, covariance=STEP) for one in drive()]
    for scan in (look(pose(), clutter=30), assemble(exact), assemble(every)):
        own = last_view(scan)[1]
        assert len(own) == 0
        context = context_of(INDEX, scan)
        verdict = replace(judge(context, search_and_rank(context)), usable=False)
        late = replace(context, deadline=Deadline(time.monotonic() - 1.0))
        assert (search_last_view(late, verdict).result, search_last_view(late, verdict).complete) == (None, True)


@pytest.mark.parametrize("with_beams", [False, True])
def test_the_last_view_is_the_scan_that_was_sent(with_beams: bool) -> None:
    views = drive(with_beams=with_beams)
    found, own = last_view(context_of(INDEX, assemble(views)).scan)
    sent = views[0].scan
    assert own.tolist() == list(range(len(sent.measured)))
    np.testing.assert_allclose(found.measured.segments.endpoints, sent.measured.segments.endpoints, atol=1e-12)
    np.testing.assert_array_equal(found.measured.point_counts, sent.measured.point_counts)
    assert found.views is None
    assert found.viewpoint == pytest.approx(sent.viewpoint)
    assert (found.beams is None) is not with_beams
    if found.beams is not None and sent.beams is not None:
        np.testing.assert_allclose(found.beams.angles, sent.beams.angles, atol=1e-12)
        np.testing.assert_array_equal(found.beams.ranges, sent.beams.ranges)
        assert found.beams.origins is None


@pytest.mark.parametrize("with_beams", [False, True])
def test_several_sensors_at_the_last_place_are_one_view(with_beams: bool) -> None:
    """Each with a mount of its own, which is exact."""
    mounts = (pose(0.3, 0.2, 0.8), pose(-0.3, -0.1, -2.0))
    here = [View(look(at, with_beams=with_beams), at) for at in mounts]
    before = [replace(one, relative_to=None) for one in drive(with_beams=with_beams)[1:]]
    found, own = last_view(assemble([here[0], *before, here[1]]))
    assert found.views is not None
    assert (len(found.views), found.views.uncertain) == (2, False)
    counts = [len(one.scan.measured) for one in (here[0], *before, here[1])]
    assert own.tolist() == [*range(counts[0]), *range(sum(counts) - counts[-1], sum(counts))]
    both = assemble(here)
    np.testing.assert_allclose(found.measured.segments.endpoints, both.measured.segments.endpoints, atol=1e-12)
    assert both.views is not None
    np.testing.assert_array_equal(found.views.of_segment, both.views.of_segment)
    np.testing.assert_array_equal(found.views.of_beam, both.views.of_beam)
    one, other = answer_of(INDEX, found), answer_of(INDEX, both)
    assert (one.usable, one.status) == (other.usable, other.status)
    assert same_pose(pose_in(one), pose_in(other), 1e-6, 1e-6)


def test_what_is_strange_about_the_drive_is_still_told() -> None:
    """Segments of earlier views with begin and end exchanged may be why it is not usable."""
    first, *others = drive(clutter=0)
    backwards = []
    for one in others:
        ends = one.scan.measured.segments.endpoints[:, [2, 3, 0, 1]]
        backwards.append(replace(one, scan=scan_of(ends, viewpoint=(0.0, 0.0))))
    found = associate(INDEX, assemble([first, *backwards]), None, AssociationOptions())
    if LAST_VIEW_ONLY.code in codes(found):
        assert found.usable
    assert "faces_away" in codes(found)
