"""The features that the probability of an answer depends on."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from registration.layout import Records

from ..consensus.beams import cast, evidence_of
from ..consensus.consensus_set import ConsensusSet
from ..consensus.estimator import Estimate
from ..consensus.tuning import AGREEING, AGREEING_FRACTION, MISSING_LENGTH, MISSING_RANGE, MISSING_SINE, NEAR, NEUTRAL
from ..context import SearchContext
from ..result import ReasonCode
from .alternatives import Comparison
from .tuning import (
    CROWD_TEMPERATURE,
    LEAST_MISFIT,
    LEAST_THING,
    LIKE_WALLS,
    MAX_GAP,
    MOST_DEVIATION,
    MOST_MISFIT,
    MOST_NULL,
    MOST_UNMATCHED,
    MOVED_BEFORE,
    NULL_ENOUGH,
    NULL_FRACTION,
    OF_A_THING,
    SEEN_BEFORE,
)

FOR, AGAINST, EITHER = 1, -1, 0


class Role(NamedTuple):
    """The role of a feature: the reason that it gives, the direction in which it counts, and whether it needs beams."""

    reason: ReasonCode
    sign: int
    needs_beams: bool = False


ROLES: Mapping[str, Role] = {
    "uniqueness": Role("similar_place", FOR),
    "deviation": Role("single_wall", AGAINST),
    "unmatched": Role("map_mismatch", AGAINST),
    "agreement": Role("map_mismatch", FOR, needs_beams=True),
    "blocked": Role("map_mismatch", AGAINST),
    "nearer": Role("map_mismatch", AGAINST, needs_beams=True),
    "misfit": Role("map_mismatch", EITHER),
    "walls": Role("insufficient_evidence", FOR),
    "null_gap": Role("not_on_map", FOR),
}


class Features(NamedTuple):
    """Numbers of one answer.

    Attributes
    ----------
    uniqueness : float
        Minus the logarithm of the evidence of all alternatives over its own, at a high temperature, which is higher
        where much has moved, nats; at most that of the places that the other walls of the map make: on a small map it
        says little that there is no other one.
    deviation : float
        Standard deviation of the sensor's place along its weakest direction without the wall that fixes it most, m.
    unmatched : float
        Root of the length of unmatched lines that are as long as walls, m^0.5.
    agreement : float
        Fraction of the beams with evidence that show what the map does.
    blocked : float
        Root of the penalty of walls that were passed, nats^0.5; of ranges the root of the fraction of beams.
    nearer : float
        Root of the fraction of beams that read nearer than the map shows.
    misfit : float
        Logarithm of the mean squared offset over what the scan's sigmas alone expect.
    walls : float
        Root of the number of walls that are matched.
    null_gap : float
        Root of the answer's score less that of the mirrored scan, nats^0.5.
    """

    uniqueness: float
    deviation: float
    unmatched: float
    agreement: float
    blocked: float
    nearer: float
    misfit: float
    walls: float
    null_gap: float


@dataclass(frozen=True, slots=True)
class Described:
    """An answer as the verdict describes it: its features, its comparison with others, and the null score, nats."""

    features: Features
    comparison: Comparison
    null: float


def describe(context: SearchContext, best: ConsensusSet, estimate: Estimate, comparison: Comparison) -> Described:
    """Return the features of an answer among its alternatives, with the least null score there is."""
    lines = context.lines.rows
    per_view = _views(context)
    left = (1.0 - best.parts) * lines["length"]
    unmatched = float(left @ np.interp(lines["length"], LIKE_WALLS, (0.0, 1.0)))
    offsets = best.matches["offset"] ** 2 / lines["plain_variance"]
    misfit = float(best.parts @ offsets) / max(1e-9, float(best.parts.sum()))
    alike = np.exp(-_unmoved(lines, best) * np.maximum(0.0, comparison.gaps) / CROWD_TEMPERATURE)
    crowd = comparison.counted * alike
    walls = float(estimate.leverages.own.sum())
    places = max(1.0, (len(context.index.walls.rows) - walls) / max(1.0, walls))
    agreement, blocked, nearer = _of_beams(context, best)
    features = Features(
        uniqueness=-math.log(max(float(crowd.sum()), 1.0 / places)),
        deviation=min(MOST_DEVIATION, max(estimate.weakest, float(estimate.leverages.deviations.max(initial=0.0)))),
        unmatched=math.sqrt(min(MOST_UNMATCHED, unmatched / per_view)),
        agreement=agreement,
        blocked=math.sqrt(blocked / (1.0 if context.with_beams else per_view)),
        nearer=math.sqrt(nearer),
        misfit=math.log(min(MOST_MISFIT, max(LEAST_MISFIT, misfit))),
        walls=math.sqrt(walls),
        null_gap=0.0,
    )
    return with_null(Described(features, comparison, 0.0), best, 0.0)


def _unmoved(lines: Records, best: ConsensusSet) -> float:
    """Return how much is known to be where the map has it, 0 to 1, by the log odds that a thing was not moved.

    A scan of which much is not on the map was taken where much has moved, or on another map.
    """
    things = lines["length"] > LEAST_THING
    moved = int((things & (best.parts < 0.5)).sum()) + MOVED_BEFORE
    return min(1.0, max(0.0, math.log((int(things.sum()) + SEEN_BEFORE) / moved - 1.0) / OF_A_THING))


def with_null(described: Described, best: ConsensusSet, null: float) -> Described:
    """Return the same with a null score."""
    ratio = min(MOST_NULL, max(NULL_FRACTION, null / best.score)) if best.score > 0.0 else NULL_ENOUGH
    gap = (1.0 - ratio) * best.score
    root = math.copysign(math.sqrt(min(abs(gap), MAX_GAP)), gap)
    return Described(described.features._replace(null_gap=root), described.comparison, null)


def _views(context: SearchContext) -> float:
    """Return how many places a scan was seen from: each view of a drive adds to what no map shows."""
    views = context.scan.views
    return float(views.weights.sum()) if views is not None and views.uncertain else 1.0


def _of_beams(context: SearchContext, best: ConsensusSet) -> tuple[float, float, float]:
    """Return the agreement of the view with the map's, and how far beams pass, and read nearer."""
    beams = context.beams
    if not len(beams) or not context.can_look:
        return NEUTRAL, 0.0, 0.0
    if not context.with_beams:
        return NEUTRAL, best.by_pairs - best.score, 0.0
    table = cast(context, beams, best.estimate)
    weights, ranges, shown, seen = beams.weights, beams.rows["range"], table[0], evidence_of(context, beams, table)
    hits = shown["wall"] >= 0
    tolerance = AGREEING + AGREEING_FRACTION * np.where(np.isfinite(ranges), ranges, 0.0)
    agree = hits & (np.abs(shown["distance"] - np.where(np.isfinite(ranges), ranges, -1e9)) < tolerance)
    rows = context.index.obstacles.walls[shown["wall"]]
    should = (shown["distance"] < MISSING_RANGE) & (rows["end"] - rows["begin"] > MISSING_LENGTH)
    should &= shown["incidence"] > MISSING_SINE
    against = hits & ~agree & np.where(np.isfinite(ranges), shown["distance"] < ranges, should)
    evident = float(weights @ (agree | against))
    agreement = float(weights @ agree) / evident if evident > 0.0 else NEUTRAL
    total = max(1e-9, float(weights.sum()))
    with np.errstate(invalid="ignore"):
        nearer = float(weights @ (seen.across[0] < -NEAR)) / total
    return agreement, float(weights @ seen.passed[0]) / total, nearer
