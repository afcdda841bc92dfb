"""From the matches on walls to correspondences with the map's own segments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import Correspondences, RegistrationOptions, RegistrationResult, RigidTransform
from registration.layout import POSE, Floats
from registration.solve import register_pairs
from registration.weights import MIN_WEIGHT

from ..context import SearchContext
from ..index.map_index import MapIndex
from ..layout import record
from ..result import Correspondence
from .consensus_set import ConsensusSet
from .kernels.acceptance import lay_segments, weigh_pairs
from .tuning import MAX_OTHERS

Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Accepted:
    """A consensus set in the map's own segments.

    Attributes
    ----------
    pairs : (k, 2) intp
        Scan and map segment, ascending by scan segment; the map's of the index, which has each twice where directions
        mean nothing.
    overlaps : (k,) float64
        Fraction of the scan segment's length that lies on the map.
    others : (k, m) intp
        Other map segments that each scan segment lies on, and -1 behind them.
    """

    pairs: Indices
    overlaps: Floats
    others: Indices

    @property
    def scan_indices(self) -> list[int]:
        """Scan index of each pair."""
        return [int(i) for i in self.pairs[:, 0].tolist()]

    def map_indices(self, index: MapIndex) -> list[int]:
        """Return the map index of each pair, as sent."""
        return [int(i) for i in (self.pairs[:, 1] % index.directed).tolist()]


def accept(context: SearchContext, best: ConsensusSet, pose: RigidTransform) -> Accepted:
    """Pick for every matched scan segment the piece of its wall that it lies on most at a pose; ties by index.

    A scan line consists of several segments. Of these, one that hardly lies on the wall is left out. The pose is index
    frame from scan frame.
    """
    index, row_of = context.index, context.lines.row_of
    on = best.matches["wall"][row_of]
    segments = np.flatnonzero(on >= 0)
    on, overlaps, others = on[segments], np.empty(len(segments)), np.empty((len(segments), MAX_OTHERS), np.intp)
    ends = context.scan.measured.segments.endpoints[segments]
    at = record(POSE, x=pose.x, y=pose.y, theta=pose.theta)
    lay_segments(ends, on, at, index.walls.rows, index.pieces, overlaps, others)
    several = np.bincount(row_of, minlength=len(best.matches))[row_of[segments]] > 1
    kept = (overlaps >= context.gates["least_overlap"][0]) | ~several
    return Accepted(np.stack([segments, on], axis=1)[kept], overlaps[kept], others[kept])


def register_accepted(
    context: SearchContext, best: ConsensusSet, accepted: Accepted, wall_sigma: float, at: RigidTransform | None
) -> RegistrationResult:
    """Register the scan by the pairs, with the walls' error; or evaluate the pairs at a pose in the map frame.

    Pairs on the same wall, or on tied walls, see the same error of it. So each has the weight ``w / (1 + s^2 W)``: w is
    its own information, ``1 / sigma^2`` times its points, W that of all pairs on its wall, and s the wall's standard
    deviation. Evidence that another segment of the same line has already is not counted again.
    """
    index, options, measured = context.index, context.options, context.scan.measured
    sigma = wall_sigma if index.sigma is None else index.sigma
    pairs = Correspondences.of(index.segments, measured, accepted.pairs)
    weights = _weights(context, best, accepted, pairs.variances, sigma)
    if weights is None and index.sigma == 0.0 and not measured.sigma[accepted.pairs[:, 0]].all():
        sigma = wall_sigma  # nothing at all is known to be off, and pairs need a weight
    fit = RegistrationOptions(estimator=options.estimator, rotation=options.rotation, weights=weights)
    at = None if options.estimator == "one_step" else at
    return register_pairs(pairs, sigma, fit, at)


def _weights(
    context: SearchContext, best: ConsensusSet, accepted: Accepted, variances: Floats, wall_sigma: float
) -> Floats | None:
    """Return the weights of pairs that have evidence in common, (n,) 1/m^2; None where none have."""
    measured, rows = context.scan.measured, context.lines.row_of[accepted.pairs[:, 0]]
    walls, weights = best.matches["wall"][rows], np.empty(len(rows))
    ties, ends = context.index.ties[walls], measured.segments.endpoints[accepted.pairs[:, 0]]
    shared = weigh_pairs(rows, walls, ties, ends, variances, wall_sigma**2, weights)
    return np.where(weights >= MIN_WEIGHT, weights, 0.0) if shared else None


def correspondences(index: MapIndex, accepted: Accepted, registered: RegistrationResult) -> tuple[Correspondence, ...]:
    """Report the consensus set by scan index."""
    columns = (accepted.overlaps, registered.offsets, registered.angles, registered.weights)
    values = (column.tolist() for column in columns)
    others = (tuple(k % index.directed for k in some if k >= 0) for some in accepted.others.tolist())
    return tuple(map(Correspondence, accepted.scan_indices, accepted.map_indices(index), *values, others))
