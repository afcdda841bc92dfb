"""Explanations made by hand, for the tests of what is concluded from them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from association import AssociationResult, Prior, SearchReport
from association.consensus.acceptance import Accepted
from association.consensus.consensus_set import ConsensusSet
from association.consensus.estimation import EstimatedPose
from association.consensus.sight import BeamFractions
from association.context import SearchContext
from association.explanations import Answer, Explanations
from association.layout import LEVERAGE, MATCH
from association.report import report
from association.to_scale import ScaledSearch
from association.verdict.alternatives import compare_alternatives
from association.verdict.features import Features, describe, facts_of, scores_of
from association.verdict.verdict import Verdict
from registration import MeasuredSegments, RegistrationResult, RigidTransform, Segments, register
from registration.layout import Floats, Records

from .records import estimate_of
from .scenes import CORRIDOR, INSIDE, ROOM, beams_of, context_of, index_of, local, pose, scan_of, seen

ROOM_INDEX = index_of(ROOM)
SCAN = scan_of(seen(ROOM, INSIDE)[0], viewpoint=(0.0, 0.0))
SHARP = np.diag([1e-4, 1e-4, 1e-6])
NOTHING_AMISS = BeamFractions()
NO_PAIRS = Accepted(np.zeros((0, 2), np.intp), np.zeros(0), np.zeros(0, np.intp), np.zeros(1, np.intp))


def room(with_beams: bool = False, prior: Prior | None = None) -> SearchContext:
    """Prepare the search for all that is seen of ROOM, 8 segments; with the beams of a laser, or without."""
    return replace(_room(with_beams), prior=prior)


@cache
def _room(with_beams: bool) -> SearchContext:
    beams = beams_of(ROOM_INDEX, INSIDE) if with_beams else None
    return context_of(ROOM_INDEX, replace(SCAN, beams=beams))


@cache
def walls_of_lines() -> list[int]:
    """Return the wall of ROOM that each line of the scan lies on."""
    walls, at = ROOM_INDEX.walls.rows, local(ROOM_INDEX, INSIDE)
    found = []
    for line in _room(False).lines.rows:
        x, y = at.apply(np.array([[line["x"], line["y"]]]))[0]
        theta = line["angle"] + at.theta
        turned = walls["dx"] * math.cos(theta) + walls["dy"] * math.sin(theta)
        off = np.abs(walls["dx"] * y - walls["dy"] * x - walls["offset"])
        along = walls["dx"] * x + walls["dy"] * y
        on = (off < 1e-6) & (turned > 0.999) & (along > walls["begin"]) & (along < walls["end"])
        found.append(int(np.flatnonzero(on)[0]))
    return found


def matches_of(walls: Sequence[int]) -> Records:
    """Return matches with these walls, or -1."""
    matches = np.zeros(len(walls), MATCH)
    matches["wall"] = walls
    matches["score"] = np.where(matches["wall"] >= 0, 10.0, 0.0)
    return matches


def ranked(
    score: float = 100.0,
    prior: float = 0.0,
    *,
    matched: int = 8,
    at: RigidTransform | None = None,
    covariance: Floats = SHARP,
    walls: Sequence[int] = range(8),
    **scores: Any,
) -> ConsensusSet:
    """Return an explanation of a scan of 8 segments, matched with `walls`.

    `at` in the index frame, `prior` what one says of it.
    """
    usual = {
        "inside": True,
        "chi_square": 6.0,
        "one_step_chi_square": 9.0,
        "length": 3.75 * matched,
        "fraction": 0.9,
        "misfit": 1.0,
        "blocked": 0.0,
        "read": 0.0,
        "passed": 0.0,
        "count": matched,
    }
    named: dict[str, Any] = {**usual, **scores}
    found = local(ROOM_INDEX, INSIDE) if at is None else at
    matches = matches_of([wall if k < matched else -1 for k, wall in enumerate(walls)])
    each = max(2.0, score / max(1, matched)) if score > 0.0 else 0.0  # less counts as a match in part
    matches["score"] = np.where(matches["wall"] >= 0, each, 0.0)
    return ConsensusSet(estimate_of(found, covariance), score, score + prior, matches=matches, **named)


@cache
def registered_room() -> RegistrationResult:
    """Return what comes of all true pairs of ROOM."""
    truth = seen(ROOM, INSIDE)[1]
    return register(Segments.from_array(ROOM), SCAN.measured, np.stack([np.arange(8), truth], axis=1))


@cache
def registered_corridor() -> RegistrationResult:
    """Return what comes of two parallel walls."""
    segments = Segments.from_array(CORRIDOR)
    ends = pose(4.0, 0.8).inverse().apply(CORRIDOR.reshape(-1, 2, 2)).reshape(-1, 4)
    return register(segments, MeasuredSegments.from_segments(Segments.from_array(ends)), [[0, 0], [1, 1]])


def leverages_of(*each: tuple[int, float, float]) -> Records:
    """Return what a pose would be without some walls: the wall, by how much it moves, and its deviation then."""
    leverages = np.zeros(len(each), LEVERAGE)
    for one, (wall, moves, deviation) in zip(leverages, each, strict=True):
        one["wall"], one["displacement"], one["deviation"], one["dx"], one["dy"] = wall, moves, deviation, 0.6, 0.8
        one["own"] = 1.0
    return leverages


def estimated_of(
    registered: RegistrationResult,
    leverages: Records | None = None,
    weakest: float | None = None,
    wall_sigma: float = 0.015,
) -> EstimatedPose:
    """Return a pose as registration has it, worked out with the error of walls; it leverages on none, or on these."""
    covariance = SHARP if registered.covariance is None else registered.covariance
    values, vectors = np.linalg.eigh(covariance[:2, :2])
    along = vectors[:, 1] * (1.0 if vectors[0, 1] >= 0.0 else -1.0)
    return EstimatedPose(
        pose=local(ROOM_INDEX, registered.pose or INSIDE),
        covariance=covariance,
        wall_sigma=wall_sigma,
        weakest=float(np.sqrt(values[1])) if weakest is None else weakest,
        direction=registered.unobservable or (float(along[0]), float(along[1])),
        free=registered.degenerate,
        parallel=registered.degenerate,
        leverages=leverages_of() if leverages is None else leverages,
    )


def answer_with(
    best: ConsensusSet,
    registered: RegistrationResult | None = None,
    *,
    estimated: EstimatedPose | None = None,
    agreement: float = 0.95,
    beams: BeamFractions = NOTHING_AMISS,
    significance: float = 1e-9,
    accepted: Accepted = NO_PAIRS,
) -> Answer:
    given = registered or registered_room()
    return Answer(best, accepted, estimated or estimated_of(given), given, agreement, beams, significance)


def explanations_of(answer: Answer | None, *others: ConsensusSet, complete: bool = True) -> Explanations:
    """Return an answer next to other explanations; those within the window first, the best first."""
    own = () if answer is None else (answer.best,)
    listed = sorted((*own, *others), key=lambda one: (not one.inside, -one.posterior))
    return Explanations(tuple(listed), answer, SearchReport(complete, False, 0.9999, 12, 34, 5, 0, "ordered", 0.75))


def report_of(context: SearchContext, explanations: Explanations, verdict: Verdict) -> AssociationResult:
    """Report explanations of a scan that was searched as it was sent."""
    return report(ScaledSearch(context, explanations, explanations), verdict)


def features_of(context: SearchContext, answer: Answer, rivals: Sequence[ConsensusSet] = ()) -> Features:
    alternatives = compare_alternatives(answer.best, rivals)
    scores, facts = scores_of(context, answer.best), facts_of(context, answer)
    return Features(*describe(scores, answer.best.posterior, facts, alternatives).item())
