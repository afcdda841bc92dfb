"""Compare the best explanation with its alternatives: perceptual aliasing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from registration.layout import Floats, Records

from ..consensus.beams import cast, evidence_of
from ..consensus.consensus_set import ConsensusSet
from ..consensus.ranking import score
from ..consensus.tuning import BEAMS_PASSED, BEAMS_READ, BLOCKED, BLOCKING_LENGTH, BLOCKING_RAYS, NEAR, SIGHT_TOLERANCE
from ..context import SearchContext
from ..scan.beams import BeamSet, probes, together
from ..scan.scan_lines import ScanLines
from ..tuning import LEAST_OFF_WALLS, LOOSE_WALLS, MODEL_OFFSET
from .kernels.things import compare_things
from .tuning import COMPARED, COUNTED, LOOSE_BEAMS, LOOSE_FACTOR, UNCOUNTED


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
        return np.asarray(self.counted * np.exp(-np.clip(self.gaps, -20.0, 500.0)))

    @property
    def probability(self) -> float:
        """The probability of the explanation among them, 0 to 1."""
        return 1.0 / (1.0 + float(self.weights.sum()))


def compare(
    context: SearchContext, best: ConsensusSet, others: Sequence[ConsensusSet], wall_sigma: float
) -> Comparison:
    """Compare an explanation with the next ones, thing by thing, with walls off by as much as they may be.

    Each explanation is refined again with wide gates, since of many similar places the one that fits best shows smaller
    errors of walls than there are; near ones that explain a part of the walls each become one. Then the evidence of
    each place in view is compared: whether a scan line has a wall of its direction there, and what the beams read.
    Neighbouring places at which it differs are one thing. A thing may have been moved, whichever explanation it speaks
    for, and on whichever side it is missing: so it counts `OF_A_THING` at most, and one thing alone never decides.
    """
    others = tuple(others[:COMPARED])
    if not others:
        return Comparison((), *np.zeros((2, 0)))
    sets = (best, *others)
    posteriors, scores = np.array([(one.posterior, one.score) for one in sets]).T
    ratios = posteriors[1:] / posteriors[0] if posteriors[0] > 0.0 else np.ones(len(others))
    counted = np.clip((ratios - UNCOUNTED) / (COUNTED - UNCOUNTED), 0.0, 1.0)
    priors = posteriors[0] - scores[0] - (posteriors - scores)[1:]
    return Comparison(others, _compare_things(context, sets, wall_sigma) + priors, counted)


def _compare_things(context: SearchContext, sets: Sequence[ConsensusSet], wall_sigma: float) -> Floats:
    """Return by how much the first explanation has more evidence than each other, nats."""
    sigma = _loose_sigma(context, wall_sigma)
    wider, loose = 1.0 / LOOSE_BEAMS, context
    if sigma is not None:
        wider = math.hypot(sigma, MODEL_OFFSET) / NEAR
        loose = context.with_scan(context.scan, ScanLines.of(context.scan, sigma, context.options))
    estimates = np.concatenate([one.estimate for one in sets])
    score(loose, estimates)
    lines = context.rays_to_lines
    seen = len(lines) > 0 or context.with_beams
    if not seen:
        lines, behind = probes(context.lines.sightings)
    beams = together(lines, context.beams) if context.with_beams else lines
    table = cast(context, beams, estimates)
    ranges = beams.rows["range"]
    passes = seen & (table["wall"] >= 0) & (table["distance"] < ranges - SIGHT_TOLERANCE)
    distances = np.where(passes, table["distance"], np.where(np.isfinite(ranges), ranges, beams.reach))
    of_lines = _of_lines(context, lines, table[:, : len(lines)], estimates["theta"], wider)
    if not seen:
        table_behind = cast(context, behind, estimates)
        of_lines = np.maximum(of_lines, _of_lines(context, behind, table_behind, estimates["theta"], wider))
    if context.with_beams:
        read = evidence_of(context, context.beams, table[:, len(lines) :], max(1.0, LOOSE_BEAMS * wider))
        weights = context.beams.weights / max(1e-9, float(context.beams.weights.sum()))
        values = np.hstack([of_lines, weights * (BEAMS_READ * read.read - BEAMS_PASSED * read.passed)])
    else:
        rows = context.index.obstacles.walls[table["wall"]]
        lengths = np.minimum(BLOCKING_LENGTH, rows["end"] - rows["begin"])
        values = of_lines - np.where(passes, BLOCKED * lengths / BLOCKING_RAYS, 0.0)
    return compare_things(values, distances, beams.rows)


def _of_lines(context: SearchContext, rays: BeamSet, table: Records, headings: Floats, wider: float) -> Floats:
    """Return the evidence of each ray to a scan line at each pose, (k, m) nats.

    It is the ray's part of the line's gain, as far as it ends on a wall of the direction of the line.
    """
    lines, walls = context.lines.rows[rays.line], context.index.obstacles.walls[table["wall"]]
    c, s = np.cos(headings)[:, None], np.sin(headings)[:, None]
    dx, dy = c * lines["dx"] - s * lines["dy"], s * lines["dx"] + c * lines["dy"]
    gates = context.gates[0]
    gate = np.clip(gates["sigmas"] * np.sqrt(lines["angle_variance"]), gates["least_angle"], gates["greatest_angle"])
    cosines = dx * walls["dx"] + dy * walls["dy"]
    along = (cosines if context.options.oriented else np.abs(cosines)) >= np.cos(gate)
    part = np.where(along, lines["gain"] / np.bincount(rays.line)[rays.line], 0.0)
    return np.asarray(part * evidence_of(context, rays, table, wider).read)


def _loose_sigma(context: SearchContext, wall_sigma: float) -> float | None:
    """Return the deviation of walls' offsets beyond `MODEL_OFFSET`, metres; None where the map is declared exact."""
    declared = context.index.sigma
    if declared is None:
        loose = max(LOOSE_WALLS, LOOSE_FACTOR * wall_sigma)
        return math.sqrt(loose * loose - MODEL_OFFSET * MODEL_OFFSET)
    if declared < LEAST_OFF_WALLS:
        return None
    return min(LOOSE_FACTOR * declared, max(declared, LOOSE_WALLS))
