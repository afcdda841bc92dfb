"""Explanations made by hand, for the tests of what is concluded from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from association import Prior, SearchReport
from association.consensus.acceptance import Accepted
from association.consensus.ranking import Ranked
from association.consensus.settling import Settled
from association.consensus.sight import BeamShares
from association.context import SearchContext
from association.explanations import Answer, Explanations
from association.layout import HINGE, MATCH
from registration import MeasuredSegments, RegistrationResult, RigidTransform, Segments, register
from registration.layout import Floats, Records

from .records import estimate_of
from .scenes import CORRIDOR, INSIDE, ROOM, beams_of, context_of, index_of, local, pose, scan_of, seen

ROOM_INDEX = index_of(ROOM)
SCAN = scan_of(seen(ROOM, INSIDE)[0], viewpoint=(0.0, 0.0))
SHARP = np.diag([1e-4, 1e-4, 1e-6])
NOTHING_AMISS = BeamShares()
NO_PAIRS = Accepted(np.zeros((0, 2), np.intp), np.zeros(0), np.zeros(0, np.intp), np.zeros(1, np.intp))


def room(with_beams: bool = False, prior: Prior | None = None) -> SearchContext:
    """Prepare the search for all that is seen of ROOM, 8 segments; with the beams of a laser, or without."""
    return replace(_room(with_beams), prior=prior)


@cache
def _room(with_beams: bool) -> SearchContext:
    beams = beams_of(ROOM_INDEX, INSIDE) if with_beams else None
    return context_of(ROOM_INDEX, replace(SCAN, beams=beams))


def matches_of(walls: Sequence[int]) -> Records:
    """Return matches with these walls, or -1."""
    matches = np.zeros(len(walls), MATCH)
    matches["wall"] = walls
    matches["worth"] = np.where(matches["wall"] >= 0, 10.0, 0.0)
    return matches


def ranked(
    score: float = 100.0,
    prior: float = 0.0,
    *,
    matched: int = 8,
    at: RigidTransform | None = None,
    covariance: Floats = SHARP,
    **merits: Any,
) -> Ranked:
    """Return an explanation of a scan of 8 segments; `at` in the index frame, `prior` what one says of it."""
    usual = {
        "inside": True,
        "cost": 6.0,
        "one_step_cost": 9.0,
        "length": 30.0,
        "share": 0.9,
        "reliability": 0.8,
        "misfit": 1.0,
        "blocked": 0.0,
        "read": 0.0,
        "passed": 0.0,
        "count": matched,
    }
    named: dict[str, Any] = {**usual, **merits}
    found = local(ROOM_INDEX, INSIDE) if at is None else at
    matches = matches_of([k if k < matched else -1 for k in range(8)])
    return Ranked(estimate_of(found, covariance), score, score + prior, matches=matches, **named)


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


def hinges_of(*each: tuple[int, float, float]) -> Records:
    """Return what a pose would be without some walls: the wall, by how much it moves, and its deviation then."""
    hinges = np.zeros(len(each), HINGE)
    for one, (wall, moves, deviation) in zip(hinges, each, strict=True):
        one["wall"], one["moves"], one["deviation"], one["dx"], one["dy"] = wall, moves, deviation, 0.6, 0.8
        one["own"] = 1.0
    return hinges


def settled_of(
    registered: RegistrationResult,
    hinges: Records | None = None,
    weakest: float | None = None,
    wall_sigma: float = 0.015,
) -> Settled:
    """Return a pose as registration has it, worked out with the error of walls; it hinges on none, or on these."""
    covariance = SHARP if registered.covariance is None else registered.covariance
    values, vectors = np.linalg.eigh(covariance[:2, :2])
    along = vectors[:, 1] * (1.0 if vectors[0, 1] >= 0.0 else -1.0)
    return Settled(
        pose=local(ROOM_INDEX, registered.pose or INSIDE),
        covariance=covariance,
        wall_sigma=wall_sigma,
        weakest=float(np.sqrt(values[1])) if weakest is None else weakest,
        direction=registered.unobservable or (float(along[0]), float(along[1])),
        free=registered.degenerate,
        parallel=registered.degenerate,
        hinges=hinges_of() if hinges is None else hinges,
    )


def answer_with(
    best: Ranked,
    registered: RegistrationResult | None = None,
    *,
    settled: Settled | None = None,
    agreement: float = 0.95,
    beams: BeamShares = NOTHING_AMISS,
    significance: float = 1e-9,
    accepted: Accepted = NO_PAIRS,
) -> Answer:
    given = registered or registered_room()
    return Answer(best, accepted, settled or settled_of(given), given, agreement, beams, significance)


def explanations_of(answer: Answer | None, *others: Ranked, complete: bool = True) -> Explanations:
    """Return an answer beside other explanations; those within the window first, the best first."""
    own = () if answer is None else (answer.best,)
    listed = sorted((*own, *others), key=lambda one: (not one.inside, -one.value))
    return Explanations(tuple(listed), answer, SearchReport(complete, False, 0.9999, 12, 34, 5, 0, "ordered", 0.75))
