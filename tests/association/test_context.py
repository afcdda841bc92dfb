"""A search is prepared as it was asked for."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from association import Deadline, HardPrior, MapIndex, Prior, SoftPrior, mirrored
from association.layout import GATES, HARD_PRIOR, NO_PRIOR, RULES, SOFT_PRIOR, record
from association.scan.scan_lines import ScanLines
from association.scan.tuning import GATE_SIGMAS, LEAST_ANGLE_GATE, LEAST_OFFSET_GATE
from association.tuning import GREATEST_ANGLE_GATE, REACH
from registration import RigidTransform

from .answers import ROOM_INDEX, SCAN
from .records import UPPER
from .scenes import INSIDE, ROOM, beams_of, context_of, index_of, pose, scan_of

ENDS = SCAN.measured.segments.endpoints
BEAMS = beams_of(ROOM_INDEX, INSIDE)
SOFT = SoftPrior(pose(6.5, 4.25, 0.3), np.array([[0.5, 0.1, 0.02], [0.1, 0.4, 0.03], [0.02, 0.03, 0.2]]))
HARD = HardPrior(pose(6.5, 4.25, 0.3), 0.7, 0.2)


def test_without_directions_the_map_is_listed_both_ways() -> None:
    assert context_of(ROOM_INDEX, SCAN).index is ROOM_INDEX
    assert context_of(ROOM_INDEX, SCAN, oriented=False).index is ROOM_INDEX.undirected


def test_the_sigma_of_the_map_counts_in_the_scans_variances() -> None:
    exact = context_of(ROOM_INDEX, SCAN).lines.rows
    rough = context_of(type(ROOM_INDEX).build(ROOM_INDEX.segments, 0.3), SCAN).lines.rows
    np.testing.assert_allclose(rough["offset_variance"] - exact["offset_variance"], 0.09)


@pytest.mark.parametrize(
    ("viewpoint", "beams", "expected"),
    [
        ((0.5, -0.25), False, (True, True)),
        (None, False, (False, False)),
        ((0.5, -0.25), True, (True, False)),
    ],
)
def test_lines_of_sight_are_evidence_where_beams_are_not(
    viewpoint: tuple[float, float] | None, beams: bool, expected: tuple[bool, bool]
) -> None:
    context = context_of(ROOM_INDEX, scan_of(ENDS, viewpoint=viewpoint, beams=BEAMS if beams else None))
    assert context.sights.places[0].item() == (viewpoint or (0.0, 0.0))
    assert (len(context.sights.seen) > 0, len(context.lines_of_sight.seen) > 0) == expected
    assert context.with_beams is beams


def test_what_the_kernels_are_asked() -> None:
    rules = record(RULES, kept_share=0.6, distinct_distance=0.3, distinct_angle=0.1, rival_share=0.9)
    context = context_of(ROOM_INDEX, SCAN, HARD, min_overlap=0.3)
    question = context.question(rules)
    assert question.scan is context.lines.rows
    assert question.rules is rules
    assert question.terms["gates"] == context.gates
    assert question.terms["gates"]["least_overlap"] == 0.3
    assert question.terms["prior"] == context.prior_record


@pytest.mark.parametrize(("prior", "window"), [(None, None), (SOFT, None), (HARD, HARD)])
def test_only_a_hard_prior_is_a_window(prior: Prior | None, window: HardPrior | None) -> None:
    assert context_of(ROOM_INDEX, SCAN, prior).window is window


def test_priors_in_the_index_frame() -> None:
    x, y = ROOM_INDEX.origin
    assert (x, y) == (4.0, 4.0)
    nothing = context_of(ROOM_INDEX, SCAN).prior_record[0]
    assert nothing["kind"] == NO_PRIOR
    soft, hard = (context_of(ROOM_INDEX, SCAN, prior).prior_record[0] for prior in (SOFT, HARD))
    for one, kind in ((soft, SOFT_PRIOR), (hard, HARD_PRIOR)):
        assert one[["kind", "theta", "x", "y"]].item() == (kind, 0.3, 2.5, 0.25)
    assert hard[["radius", "angle"]].item() == (0.7, 0.2)
    expected = np.linalg.inv(SOFT.covariance)[np.triu_indices(3)]
    assert [soft[name] for name in UPPER] == pytest.approx(expected.tolist())


def test_anywhere_is_the_same_search_without_its_prior() -> None:
    deadline = Deadline()
    context = context_of(ROOM_INDEX, SCAN, HARD, deadline, seed=3)
    free = context.anywhere()
    assert free.prior is None
    assert free.prior_record[0]["kind"] == NO_PRIOR
    assert (free.index, free.scan, free.options, free.deadline) == (ROOM_INDEX, SCAN, context.options, deadline)
    assert context.prior is HARD


def test_another_scan_instead_is_searched_without_the_prior_and_with_room_for_its_lines() -> None:
    context = context_of(ROOM_INDEX, SCAN, HARD, seed=3)
    assert len(context.workspace.held) == len(SCAN.measured)
    for scan, same in ((mirrored(SCAN), True), (scan_of(ROOM[:3]), False)):
        other = context.instead(scan, context_of(ROOM_INDEX, scan).lines)
        assert (other.scan, other.prior, other.options) == (scan, None, context.options)
        assert len(other.workspace.held) == len(scan.measured)
        assert (other.workspace is context.workspace) is same


@pytest.mark.parametrize("prior", [None, HARD])
def test_another_scan_is_asked_after_by_its_own_lines_and_without_the_prior(prior: Prior | None) -> None:
    context = context_of(ROOM_INDEX, SCAN, prior)
    loose = ScanLines.of(SCAN, 0.05, context.options)
    for lines in (context.lines.mirrored(), loose):
        asked = context.instead(SCAN, lines).question_of_a_pose
        assert asked.scan is lines.rows
        assert asked.terms["model"] == lines.model
        assert asked.terms["prior"]["kind"] == NO_PRIOR
    assert loose.model != context.lines.model


def test_poses_of_the_index_frame_in_the_map_frame() -> None:
    x, y = ROOM_INDEX.origin
    assert context_of(ROOM_INDEX, SCAN).in_map(pose(0.5, -1.0, 0.2)) == RigidTransform(0.5 + x, y - 1.0, 0.2)


def test_workspaces_have_a_place_for_every_segment() -> None:
    work = context_of(ROOM_INDEX, SCAN).workspace
    assert {len(work.matches), len(work.spreads), len(work.held)} == {8}


def test_gates() -> None:
    """A requested tolerance is the gate for all sigmas; all or nothing of a segment is nearly so."""
    usual = record(
        GATES,
        sigmas=GATE_SIGMAS,
        least_offset=LEAST_OFFSET_GATE,
        greatest_offset=REACH,
        least_angle=LEAST_ANGLE_GATE,
        greatest_angle=GREATEST_ANGLE_GATE,
        least_overlap=0.5,
    )
    assert context_of(ROOM_INDEX, SCAN).gates == usual
    asked = context_of(ROOM_INDEX, SCAN, offset_tolerance=0.2, angle_tolerance=0.1, min_overlap=0.7).gates[0]
    assert asked.item() == (GATE_SIGMAS, 0.2, 0.2, 0.1, 0.1, 0.7)
    for overlap, expected in ((0.0, 0.001), (1.0, 0.999)):
        assert context_of(ROOM_INDEX, SCAN, min_overlap=overlap).gates["least_overlap"][0] == pytest.approx(expected)


def along_rays(walls: int) -> MapIndex:
    """Return a hall of 40 m with so many short walls along its middle, which rays along it pass and do not meet."""
    rng = np.random.default_rng(0)
    hall = np.array([[0.0, 0.0, 40.0, 0.0], [40.0, 0.0, 40.0, 4.0], [40.0, 4.0, 0.0, 4.0], [0.0, 4.0, 0.0, 0.0]])
    middles = np.stack([rng.uniform(5.0, 35.0, walls), rng.uniform(1.5, 2.5, walls)], axis=1)
    half = np.array([0.005, 0.0])
    return index_of(np.vstack([hall, np.hstack([middles - half, middles + half])]))


def test_rays_are_not_followed_along_more_walls_than_can_be_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """The bound grows with the rays, with how far they go, and with the walls in one place."""
    monkeypatch.setattr("association.context.MOST_LOOKED_AT", 1_000)  # lines of sight are not traced then
    few, many = along_rays(100), along_rays(10_000)
    near = scan_of([[1.0, -1.0, 1.0, 1.0]], viewpoint=(0.0, 0.0))
    far = scan_of([[30.0, -1.0, 30.0, 1.0]], viewpoint=(0.0, 0.0))
    looks = [context_of(index, scan).looks for index, scan in product((few, many), (near, far))]
    assert looks[0] < looks[1]
    assert looks[2] < looks[3]
    assert 20.0 * looks[1] < looks[3]
    blind = scan_of([[30.0, -1.0, 30.0, 1.0]], viewpoint=None)
    assert context_of(many, blind).looks < looks[3]
    monkeypatch.setattr("association.context.MOST_LOOKED_AT", looks[2])
    assert [context_of(many, scan).can_look for scan in (near, far)] == [True, False]
    assert context_of(many, far).too_late_to_look


def test_in_a_map_of_a_building_all_rays_are_followed() -> None:
    assert context_of(ROOM_INDEX, scan_of(ENDS, viewpoint=(0.0, 0.0), beams=BEAMS)).can_look
