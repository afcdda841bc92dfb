"""Compare the best explanation with its alternatives: perceptual aliasing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from registration.layout import Floats, Records

from ..consensus.beams import cast, evidence_of
from ..consensus.consensus_set import ConsensusSet
from ..consensus.ranking import score
from ..consensus.tuning import BEAMS_PASSED, BEAMS_READ, BLOCKED, BLOCKING_LENGTH, BLOCKING_RAYS, NEAR, SIGHT_TOLERANCE
from ..context import SearchContext
from ..layout import ESTIMATE, Indices
from ..scan.beams import together
from ..scan.scan_lines import ScanLines
from ..tuning import LEAST_OFF_WALLS, LOOSE_WALLS, MODEL_OFFSET
from .tuning import (
    AS_SCORED,
    COMPARED,
    COUNTED,
    LEAST_OF_BEAM,
    LOOSE_BEAMS,
    LOOSE_FACTOR,
    MOST_AS_SCORED,
    OF_A_THING,
    TEMPERATURE,
    THING_WIDTH,
    THINGS_APART,
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
    counted : float64
        Weight of each, 0 to 1: 1 where the search cannot have missed one as good.
    """

    others: tuple[ConsensusSet, ...]
    gaps: Floats
    counted: Floats

    @property
    def weights(self) -> Floats:
        """The probability of each other over that of the explanation."""
        return np.asarray(self.counted * np.exp(-np.clip(self.gaps / TEMPERATURE, -20.0, 500.0)))

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
    explanation it speaks for, and on whichever side it is missing: so it counts `OF_A_THING` at most. Next to that a
    fraction of the difference in score counts, `MOST_AS_SCORED` of it at most: one thing alone never decides.
    """
    others = tuple(others[:COMPARED])
    if not others:
        return Comparison((), np.zeros(0), np.zeros(0))
    sets = (best, *others)
    posteriors = np.array([one.posterior for one in sets])
    priors = np.array([one.posterior - one.score for one in sets])
    ratios = posteriors[1:] / posteriors[0] if posteriors[0] > 0.0 else np.ones(len(others))
    counted = np.clip((ratios - UNCOUNTED) / (COUNTED - UNCOUNTED), 0.0, 1.0)
    evidence = _Evidence.of(context, sets, wall_sigma)
    gaps = np.array([evidence.gap(0, k) for k in range(1, len(sets))]) + priors[0] - priors[1:]
    gaps += AS_SCORED * np.minimum(posteriors[0] - posteriors[1:], MOST_AS_SCORED)
    return Comparison(others, gaps, counted)


@dataclass(frozen=True, slots=True)
class _Evidence:
    """The score of each explanation at each place in view.

    Attributes
    ----------
    values : (k, m) nats
    distances : (k, m) metres from the sensor, where the thing is that a value speaks of
    begins, ways : (m, 2) from where each place is seen, and its direction; in the scan frame
    """

    values: Floats
    distances: Floats
    begins: Floats
    ways: Floats

    @classmethod
    def of(cls, context: SearchContext, sets: Sequence[ConsensusSet], wall_sigma: float) -> _Evidence:
        sigma = _loose_sigma(context, wall_sigma)
        loose = context if sigma is None else context.with_scan(
            context.scan, ScanLines.of(context.scan, sigma, context.options, context.lines.given)
        )  # fmt: skip
        wider = 1.0 if sigma is None else max(1.0, LOOSE_BEAMS * math.hypot(sigma, MODEL_OFFSET) / NEAR)
        estimates = np.empty(len(sets), ESTIMATE)
        for k, one in enumerate(sets):
            estimates[k] = one.estimate[0]
        _, matches = score(loose, estimates)
        lines = context.rays_to_lines
        of_lines = _of_lines(context, matches, np.bincount(lines.line, minlength=matches.shape[1]))
        of_rays = of_lines[:, lines.line]
        beams = together(lines, context.beams) if context.with_beams else lines
        table = cast(context, beams, estimates)
        ranges = beams.rows["range"]
        distances = np.where(np.isfinite(ranges), ranges, beams.reach) + np.zeros((len(sets), 1))
        passes = (table["wall"] >= 0) & (table["distance"] < ranges - SIGHT_TOLERANCE)
        distances[passes] = table["distance"][passes]
        if context.with_beams:
            own = slice(len(lines), None)
            read = evidence_of(context, context.beams, table[:, own], wider)
            weights = context.beams.weights / max(1e-9, float(context.beams.weights.sum()))
            values = np.hstack([of_rays, weights * (BEAMS_READ * read.read - BEAMS_PASSED * read.passed)])
        else:
            rows = context.index.obstacles.walls
            lengths = np.minimum(BLOCKING_LENGTH, rows["end"] - rows["begin"])[table["wall"]]
            values = of_rays - np.where(passes, BLOCKED * lengths / BLOCKING_RAYS, 0.0)
        begins = np.stack([beams.rows["x"], beams.rows["y"]], axis=1)
        ways = np.stack([beams.rows["dx"], beams.rows["dy"]], axis=1)
        return cls(values, distances, begins, ways)

    def gap(self, one: int, other: int) -> float:
        """Return by how much one explanation has more evidence than another, each thing within its limit, nats."""
        more = self.values[one] - self.values[other]
        differs = np.flatnonzero(np.abs(more) > LEAST_OF_BEAM)
        if not len(differs):
            return 0.0
        more = more[differs]
        # A thing is where the map shows it to the explanation that it speaks against.
        away = np.where(more > 0.0, self.distances[other, differs], self.distances[one, differs])
        places = self.begins[differs] + away[:, None] * self.ways[differs]
        first, second = cKDTree(places).query_pairs(THINGS_APART, output_type="ndarray").T
        near = coo_array((np.ones(len(first)), (first, second)), shape=(len(places), len(places)))
        count, thing = connected_components(near, directed=False)
        low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
        np.minimum.at(low, thing, places)
        np.maximum.at(high, thing, places)
        limits = OF_A_THING * np.maximum(1.0, np.hypot(*(high - low).T) / THING_WIDTH)
        return float(np.clip(np.bincount(thing, more, count), -limits, limits).sum())


def _of_lines(context: SearchContext, matches: Records, rays: Indices) -> Floats:
    """Return the score of each scan line, (k, n) nats, for each of the rays to it."""
    return np.asarray(np.where(matches["wall"] >= 0, matches["score"], 0.0) / np.maximum(1, rays))


def _loose_sigma(context: SearchContext, wall_sigma: float) -> float | None:
    """Return the deviation of walls' offsets beyond `MODEL_OFFSET`, metres; None where the map is declared exact."""
    declared = context.index.sigma
    if declared is None:
        loose = max(LOOSE_WALLS, LOOSE_FACTOR * wall_sigma)
        return math.sqrt(loose * loose - MODEL_OFFSET * MODEL_OFFSET)
    if declared < LEAST_OFF_WALLS:
        return None
    return min(LOOSE_FACTOR * declared, max(declared, LOOSE_WALLS))
