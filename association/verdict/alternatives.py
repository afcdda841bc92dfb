"""Compare the best explanation with its alternatives: perceptual aliasing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from registration.layout import Floats

from ..consensus.beams import cast, evidence_of
from ..consensus.consensus_set import ConsensusSet
from ..consensus.ranking import score
from ..consensus.tuning import BEAMS_PASSED, BEAMS_READ, BLOCKED, BLOCKING_LENGTH, BLOCKING_RAYS, NEAR, SIGHT_TOLERANCE
from ..context import SearchContext
from ..scan.beams import rays_to_lines, together
from ..scan.scan_lines import ScanLines
from ..tuning import LEAST_OFF_WALLS, LOOSE_WALLS, MODEL_OFFSET
from .kernels.things import compare_things
from .tuning import (
    COMPARED,
    COUNTED,
    LEAST_THING,
    LOOSE_BEAMS,
    LOOSE_FACTOR,
    MOVED_BEFORE,
    OF_A_THING,
    OF_SHARE,
    SEEN_BEFORE,
    UNCOUNTED,
)


@dataclass(frozen=True, slots=True)
class Comparison:
    """An explanation compared with others, (k,) each.

    Attributes
    ----------
    others : tuple of ConsensusSet
    gaps : float64
        By how much the evidence is greater than that of each other, nats.
    by_things : float64
        The same thing by thing alone, whatever share of the score the other lacks.
    counted : float64
        Weight of each, 0 to 1: 1 where the search cannot have missed one as good.
    """

    others: tuple[ConsensusSet, ...]
    gaps: Floats
    by_things: Floats
    counted: Floats

    @property
    def weights(self) -> Floats:
        """The probability of each other over that of the explanation."""
        return np.asarray(self.counted * np.exp(-np.clip(self.gaps, -20.0, 500.0)))

    @property
    def probability(self) -> float:
        """The probability of the explanation among them, 0 to 1."""
        return 1.0 / (1.0 + float(self.weights.sum()))


def compare(
    context: SearchContext, best: ConsensusSet, others: Sequence[ConsensusSet], wall_sigma: float
) -> Comparison:
    """Compare an explanation with the next ones, thing by thing, with walls off by as much as they may be.

    Each explanation is matched again with wide gates, since of many similar places the one that fits best shows smaller
    errors of walls than there are. Then the evidence of each place in view is compared: what its scan lines score, and
    what its beams do. Neighbouring places at which it differs are one thing. A thing may have been moved, whichever
    explanation it speaks for, and on whichever side it is missing: so it counts `OF_A_THING` at most, less where more
    of the scan is not on the map, and one thing alone never decides. An alternative that lacks a large share s of the
    score is no similar place, whatever was moved: it has ``OF_SHARE s^2`` less, as far as things speak against it.
    """
    others = tuple(others[:COMPARED])
    if not others:
        return Comparison((), *np.zeros((3, 0)))
    sets = (best, *others)
    posteriors, scores = np.array([(one.posterior, one.score) for one in sets]).T
    counted = np.clip((_ratios(posteriors) - UNCOUNTED) / (COUNTED - UNCOUNTED), 0.0, 1.0)
    by_share = OF_SHARE * (1.0 - np.clip(_ratios(scores), 0.0, 1.0)) ** 2
    priors = posteriors[0] - scores[0] - (posteriors - scores)[1:]
    by_things, most = _compare_things(context, sets, wall_sigma)
    gaps = np.minimum(most, by_things + by_share)
    return Comparison(others, gaps + priors, by_things + priors, counted)


def _ratios(values: Floats) -> Floats:
    """Return the ratio of each other value to the first one, 1 where that is not positive."""
    return values[1:] / values[0] if values[0] > 0.0 else np.ones(len(values) - 1)


def _compare_things(context: SearchContext, sets: Sequence[ConsensusSet], wall_sigma: float) -> tuple[Floats, Floats]:
    """Return by how much the first explanation has more evidence than each other, and the most that it may have."""
    sigma = _loose_sigma(context, wall_sigma)
    loose = context if sigma is None else context.with_scan(
        context.scan, ScanLines.of(context.scan, sigma, context.options, context.lines.given)
    )  # fmt: skip
    wider = 1.0 if sigma is None else max(1.0, LOOSE_BEAMS * math.hypot(sigma, MODEL_OFFSET) / NEAR)
    estimates = np.concatenate([one.estimate for one in sets])
    _, matches = score(loose, estimates)
    lines = context.rays_to_lines
    seen = len(lines) > 0 or context.with_beams
    if not seen:  # from where is not known: the lines alone are evidence, and they are where they are
        sightings = context.lines.sightings
        lines = rays_to_lines(sightings, np.zeros_like(context.viewpoints), np.ones(len(context.viewpoints)))
    beams = together(lines, context.beams) if context.with_beams else lines
    table = cast(context, beams, estimates)
    ranges = beams.rows["range"]
    passes = seen & (table["wall"] >= 0) & (table["distance"] < ranges - SIGHT_TOLERANCE)
    distances = np.where(passes, table["distance"], np.where(np.isfinite(ranges), ranges, beams.reach))
    # The score of each scan line, for each of the rays to it.
    rays = np.maximum(1, np.bincount(lines.line, minlength=matches.shape[1]))
    of_rays = (np.where(matches["wall"] >= 0, matches["score"], 0.0) / rays)[:, lines.line]
    if context.with_beams:
        read = evidence_of(context, context.beams, table[:, len(lines) :], wider)
        weights = context.beams.weights / max(1e-9, float(context.beams.weights.sum()))
        values = np.hstack([of_rays, weights * (BEAMS_READ * read.read - BEAMS_PASSED * read.passed)])
    else:
        rows = context.index.obstacles.walls[table["wall"]]
        lengths = np.minimum(BLOCKING_LENGTH, rows["end"] - rows["begin"])
        values = of_rays - np.where(passes, BLOCKED * lengths / BLOCKING_RAYS, 0.0)
    return compare_things(values, distances, beams.rows, _of_a_thing(context, sets[0]))


def _of_a_thing(context: SearchContext, best: ConsensusSet) -> float:
    """Return the most that a thing counts, nats: the log odds that it was not moved.

    A scan of which much is not on the map was taken where much has moved.
    """
    things = context.lines.rows["length"] > LEAST_THING
    moved = int((things & (best.parts < 0.5)).sum())
    share = (moved + MOVED_BEFORE) / (int(things.sum()) + SEEN_BEFORE)
    return min(OF_A_THING, math.log((1.0 - share) / share)) if share < 0.5 else 0.0


def _loose_sigma(context: SearchContext, wall_sigma: float) -> float | None:
    """Return the deviation of walls' offsets beyond `MODEL_OFFSET`, metres; None where the map is declared exact."""
    declared = context.index.sigma
    if declared is None:
        loose = max(LOOSE_WALLS, LOOSE_FACTOR * wall_sigma)
        return math.sqrt(loose * loose - MODEL_OFFSET * MODEL_OFFSET)
    if declared < LEAST_OFF_WALLS:
        return None
    return min(LOOSE_FACTOR * declared, max(declared, LOOSE_WALLS))
