"""From the matches on walls to correspondences with the map's own segments."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from registration import Correspondences, RegistrationOptions, RegistrationResult, RigidTransform, register
from registration.values import value
from registration.weights import MIN_WEIGHT

from ..context import SearchContext
from ..index.map_index import MapIndex
from ..options import Estimator, Rotation
from ..result import Correspondence
from ..tables import Lines
from .consensus_set import ConsensusSet
from .estimation import EstimatedPose
from .kernels.acceptance import accept_matches
from .tuning import LEAST_KNOWN_VARIANCE, PAIRS_COMPARED

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


@value(frozen=True, slots=True)
class Accepted:
    """A consensus set in the map's own segments.

    Attributes
    ----------
    pairs : (n, 2) scan index and index of the map piece, by scan index
    overlaps : (n,) fraction of each scan segment's length that lies on pieces of its wall, or chain where it is long
    others, other_starts : pair k lies also on the pieces ``others[other_starts[k]:other_starts[k + 1]]``
    """

    pairs: Indices
    overlaps: Floats
    others: Indices
    other_starts: Indices

    @property
    def scan_indices(self) -> list[int]:
        """Scan index of each pair."""
        indices: list[int] = self.pairs[:, 0].tolist()
        return indices

    def map_indices(self, index: MapIndex) -> list[int]:
        """Return the map index of each pair, as sent."""
        indices: list[int] = (self.pairs[:, 1] % index.directed).tolist()
        return indices


def accept(context: SearchContext, best: ConsensusSet) -> Accepted:
    """Pick for every matched scan segment the piece of its wall that it lies on most; ties by index."""
    index, ends = context.index, context.ends
    lines = Lines(context.lines.rows, context.lines.row_of, float(context.gates["least_overlap"][0]))
    found = accept_matches(best.matches, lines, ends, best.estimate, index.walls.rows, index.pieces)
    return Accepted(*found)


def overlaps_at(context: SearchContext, best: ConsensusSet, accepted: Accepted, pose: RigidTransform) -> Floats:
    """Return the fraction of each accepted segment that lies on its wall, or chain, at a pose in the map, (n,)."""
    index, ends = context.index, context.ends
    at = best.estimate.copy()
    at["x"], at["y"], at["theta"] = pose.x - index.origin[0], pose.y - index.origin[1], pose.theta
    every = Lines(context.lines.rows, context.lines.row_of, 0.0)  # however little of a segment lies there
    pairs, overlaps, _, _ = accept_matches(best.matches, every, ends, at, index.walls.rows, index.pieces)
    fractions: Floats = overlaps[np.searchsorted(pairs[:, 0], accepted.pairs[:, 0])]
    return fractions


def register_accepted(
    context: SearchContext, best: ConsensusSet, accepted: Accepted, estimated: EstimatedPose, *, fitted: bool = True
) -> tuple[RegistrationResult, EstimatedPose] | None:
    """Register the scan by the pairs, with the estimated error of walls, and take that pose; None without pairs.

    So a caller who registers by the same pairs and weights gets the same pose. The estimated pose is evaluated on the
    pairs instead if it is not fixed, if views are not exact, or unless it is to be `fitted`. With the paper's estimator
    a pose of its own is fitted.
    """
    if not len(accepted.pairs):
        return None
    index, options, measured = context.index, context.options, context.scan.measured
    sigma = estimated.wall_sigma if index.sigma is None else index.sigma
    weights = _weights(context, best, accepted, sigma)
    fit = _options(options.estimator, options.rotation)
    if weights is not None:
        fit = replace(fit, weights=weights)
    elif index.sigma == 0.0 and not measured.sigma[accepted.pairs[:, 0]].all():
        sigma = estimated.wall_sigma  # nothing at all is known to be off, and pairs need a weight
    if options.estimator == "one_step":
        return register(index.segments, measured, accepted.pairs, sigma, fit), estimated
    if fitted and estimated.views is None and not estimated.free and not estimated.degenerate:
        found = register(index.segments, measured, accepted.pairs, sigma, fit)
        if found.covariance is not None and found.pose is not None:
            return found, replace(estimated, pose=context.in_index(found.pose), covariance=found.covariance)
    at = context.in_map(estimated.pose)
    return register(index.segments, measured, accepted.pairs, sigma, fit, at), estimated


@lru_cache
def _options(estimator: Estimator, rotation: Rotation) -> RegistrationOptions:
    return RegistrationOptions(estimator=estimator, rotation=rotation)


def _weights(context: SearchContext, best: ConsensusSet, accepted: Accepted, wall_sigma: float) -> Floats | None:
    """Return the weights of pairs that have evidence in common, (n,) 1/m^2; None where none have.

    Evidence of several segments for one line counts once. The error of a wall that several pairs lie on counts once,
    too: each pair takes a part of the wall's variance. A pair alone on its wall has
    ``1 / (sigma^2 / points + wall_sigma^2)``.
    """
    rows = context.lines.row_of[accepted.pairs[:, 0]]
    walls = best.matches["wall"][rows]
    ties = context.index.ties[walls]
    if len(set(walls.tolist())) == len(walls) and not (ties >= 0.0).any():
        return None
    given = Correspondences.of(context.index.segments, context.scan.measured, accepted.pairs)
    alone = _not_shown_before(given, rows) / np.maximum(given.variances, LEAST_KNOWN_VARIANCE**2)
    weights: Floats = alone / (1.0 + wall_sigma**2 * _known_together(alone, walls, ties))
    return np.where(weights >= MIN_WEIGHT, weights, 0.0)


def _known_together(alone: Floats, walls: NDArray[np.int32], ties: Floats) -> Floats:
    """Return the information of all pairs on each pair's wall, (n,) 1/m^2; as far as their own walls are one with it.

    Some pairs at a time are compared with all, so that the memory grows with their number, not with its square.
    """
    together = np.empty(len(alone))
    step = max(1, PAIRS_COMPARED // max(1, len(alone)))
    for begin in range(0, len(alone), step):
        some = slice(begin, begin + step)
        here, there = ties[some, None], walls[some, None]
        tied = (here >= 0.0) & (ties >= 0.0)
        together[some] = np.where(there == walls, 1.0, np.where(tied, np.exp(-np.abs(here - ties)), 0.0)) @ alone
    return together


def _not_shown_before(given: Correspondences, rows: Indices) -> Floats:
    """Return the fraction of each scan segment that no longer one of its line covers, (n,), of equal ones the first."""
    fractions = np.ones(len(rows))
    for row in np.flatnonzero(np.bincount(rows) > 1):
        members = np.flatnonzero(rows == row)
        members = members[np.argsort(-given.lengths[members], kind="stable")]
        along = given.directions[members[0]]
        middles = given.midpoints[members] @ along
        reach = 0.5 * given.lengths[members]
        covered = _Intervals()
        for member, low, high in zip(members.tolist(), middles - reach, middles + reach, strict=True):
            fractions[member] = max(0.0, 1.0 - covered.add(float(low), float(high)) / float(high - low))
    return fractions


class _Intervals:
    """Disjoint closed intervals, by where they begin, and when each was added."""

    def __init__(self) -> None:
        self._lows: list[float] = []
        self._highs: list[float] = []
        self._added: list[int] = []
        self._count = 0

    def add(self, low: float, high: float) -> float:
        """Unite an interval with those that it meets; return how much of it they covered before."""
        met = slice(bisect_left(self._highs, low), bisect_right(self._lows, high))
        lows, highs = self._lows[met], self._highs[met]
        # In the order in which they were added, on which the last bit of the sum depends.
        by_age = sorted(zip(self._added[met], lows, highs, strict=True))
        covered = sum(max(0.0, min(high, b) - max(low, a)) for _, a, b in by_age)
        self._lows[met], self._highs[met] = [min([low, *lows])], [max([high, *highs])]
        self._added[met] = [self._count]
        self._count += 1
        return covered


def correspondences(
    index: MapIndex, accepted: Accepted, overlaps: Floats, registered: RegistrationResult
) -> tuple[Correspondence, ...]:
    """Report the consensus set by scan index, with its reported overlaps, (n,)."""
    others, starts = (accepted.others % index.directed).tolist(), accepted.other_starts.tolist()
    columns = (overlaps, registered.offsets, registered.angles, registered.weights)
    alternatives = (tuple(others[begin:end]) for begin, end in pairwise(starts))
    values = (column.tolist() for column in columns)
    return tuple(map(Correspondence, accepted.scan_indices, accepted.map_indices(index), *values, alternatives))
