"""From the matches on walls to correspondences with the map's own segments."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from registration import Correspondences, RegistrationOptions, RegistrationResult, RigidTransform, register
from registration.layout import Floats
from registration.weights import MIN_WEIGHT

from ..context import SearchContext
from ..index.map_index import MapIndex
from ..options import Estimator, Rotation
from ..result import Correspondence
from .consensus_set import ConsensusSet
from .tuning import LEAST_KNOWN_VARIANCE, MAX_OTHERS, MIN_EXTENT, MOST_UNDER, PAIRS_COMPARED

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
    others : tuple of tuple of int
        Other map segments that each scan segment lies on.
    """

    pairs: Indices
    overlaps: Floats
    others: tuple[tuple[int, ...], ...]

    @property
    def scan_indices(self) -> list[int]:
        """Scan index of each pair."""
        return list(map(int, self.pairs[:, 0]))

    def map_indices(self, index: MapIndex) -> list[int]:
        """Return the map index of each pair, as sent."""
        return list(map(int, self.pairs[:, 1] % index.directed))


@dataclass(frozen=True, slots=True)
class _Chain:
    """The pieces of walls that continue one another, by where they begin along the first of them.

    `gaps` sums up the length without pieces before each; `reach` is how far those up to each reach.
    """

    direction: Floats
    pieces: list[int]
    walls: list[int]
    lows: list[float]
    highs: list[float]
    reach: list[float]
    gaps: list[float]

    @classmethod
    def of(cls, index: MapIndex, wall: int) -> _Chain:
        rows, pieces = index.walls.rows, index.pieces
        walls, w = [], int(pieces.firsts[wall])
        direction = np.array([rows[w]["dx"], rows[w]["dy"]])
        while w >= 0:
            walls.append(w)
            w = int(rows[w]["after"])
        items = [pieces.items[pieces.starts[w] : pieces.starts[w + 1]] for w in walls]
        own, of_wall = np.concatenate(items), np.repeat(walls, [len(one) for one in items])
        ends = pieces.ends[own]
        one = ends["x1"] * direction[0] + ends["y1"] * direction[1]
        other = ends["x2"] * direction[0] + ends["y2"] * direction[1]
        lows, highs = np.minimum(one, other), np.maximum(one, other)
        order = np.argsort(lows, kind="stable")
        lows, highs = lows[order], highs[order]
        reach = np.maximum.accumulate(highs)
        gaps = np.cumsum(np.maximum(0.0, np.concatenate([[0.0], lows[1:] - reach[:-1]])))
        columns = (own[order], of_wall[order], lows, highs, reach, gaps)
        return cls(direction, *(column.tolist() for column in columns))

    def bare_up_to(self, x: float) -> float:
        """Return the length without pieces from the first of them to an abscissa, negative before it, metres."""
        k = bisect_right(self.lows, x)
        return self.gaps[k - 1] + max(0.0, x - self.reach[k - 1]) if k else x - self.lows[0]

    def lay(self, low: float, high: float, own: int) -> tuple[int, float, tuple[int, ...]]:
        """Return the piece that a segment between two abscissae lies on most, its overlap, and the other pieces.

        One that covers over half of it and is of its own wall comes first; of equal ones the first of the map.
        """
        end = bisect_right(self.lows, high)
        begin = max(bisect_right(self.reach, low), end - MOST_UNDER)
        if begin >= end:  # beside all of them: the nearest one
            begin, end = max(0, min(begin, len(self.lows) - 1) - 1), min(len(self.lows), max(end, 1) + 1)
        overlaps = {k: min(self.highs[k], high) - max(self.lows[k], low) for k in range(begin, end)}
        half = 0.5 * (high - low)
        most = min(overlaps, key=lambda k: (overlaps[k] <= half or self.walls[k] != own, -overlaps[k], self.pieces[k]))
        covered = 0.0
        if overlaps[most] > 0.0:
            bare = self.bare_up_to(high) - self.bare_up_to(low)
            covered = max(0.0, 1.0 - bare / max(high - low, MIN_EXTENT))
        others = [self.pieces[k] for k, overlap in overlaps.items() if overlap > 0.0 and k != most]
        return self.pieces[most], covered, tuple(others[:MAX_OTHERS])


def accept(context: SearchContext, best: ConsensusSet, pose: RigidTransform) -> Accepted:
    """Pick for every matched scan segment the piece of its wall that it lies on most at a pose; ties by index.

    A scan line consists of several segments. Of these, one that hardly lies on the wall is left out. The pose is index
    frame from scan frame.
    """
    index, row_of = context.index, context.lines.row_of
    wall_of = best.matches["wall"][row_of]
    segments = np.flatnonzero(wall_of >= 0)
    walls = wall_of[segments]
    ends = pose.apply(context.scan.measured.segments.endpoints[segments].reshape(-1, 2, 2))
    pieces, overlaps = np.empty(len(segments), np.intp), np.empty(len(segments))
    others: list[tuple[int, ...]] = [()] * len(segments)
    first = index.pieces.starts[walls]
    rows = index.walls.rows[walls]
    single = (index.pieces.starts[walls + 1] - first == 1) & (rows["before"] < 0) & (rows["after"] < 0)
    # Most walls are one piece of the map.
    pieces[single] = index.pieces.items[first[single]]
    along = np.sort(ends[..., 0] * rows["dx"][:, None] + ends[..., 1] * rows["dy"][:, None], axis=1)
    covered = np.minimum(along[:, 1], rows["end"]) - np.maximum(along[:, 0], rows["begin"])
    overlaps = np.clip(covered / np.maximum(along[:, 1] - along[:, 0], MIN_EXTENT), 0.0, 1.0)
    chains = index.chains_of_pieces
    for k in np.flatnonzero(~single).tolist():
        wall = int(walls[k])
        key = int(index.pieces.firsts[wall])
        chain: _Chain = chains.get(key) or chains.setdefault(key, _Chain.of(index, wall))
        low, high = sorted((ends[k] @ chain.direction).tolist())
        pieces[k], overlaps[k], more = chain.lay(low, high, wall)
        others[k] = tuple(other % index.directed for other in more)
    several = np.bincount(row_of, minlength=len(best.matches))[row_of[segments]] > 1
    kept = np.flatnonzero((overlaps >= context.gates["least_overlap"][0]) | ~several)
    return Accepted(
        np.stack([segments[kept], pieces[kept]], axis=1), overlaps[kept], tuple(others[k] for k in kept.tolist())
    )


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
    weights = _weights(context, best, accepted, sigma)
    if weights is None and index.sigma == 0.0 and not measured.sigma[accepted.pairs[:, 0]].all():
        sigma = wall_sigma  # nothing at all is known to be off, and pairs need a weight
    fit = _options(options.estimator, options.rotation)
    if weights is not None:
        fit = RegistrationOptions(estimator=options.estimator, rotation=options.rotation, weights=weights)
    at = None if options.estimator == "one_step" else at
    return register(index.segments, measured, accepted.pairs, sigma, fit, at)


@lru_cache
def _options(estimator: Estimator, rotation: Rotation) -> RegistrationOptions:
    return RegistrationOptions(estimator=estimator, rotation=rotation)


def _weights(context: SearchContext, best: ConsensusSet, accepted: Accepted, wall_sigma: float) -> Floats | None:
    """Return the weights of pairs that have evidence in common, (n,) 1/m^2; None where none have."""
    rows = context.lines.row_of[accepted.pairs[:, 0]]
    walls = best.matches["wall"][rows]
    ties = context.index.ties[walls]
    if len(set(walls.tolist())) == len(walls) and not (ties >= 0.0).any():
        return None
    given = Correspondences.of(context.index.segments, context.scan.measured, accepted.pairs)
    alone = _not_shown_before(given, rows) / np.maximum(given.variances, LEAST_KNOWN_VARIANCE**2)
    together = np.empty(len(alone))
    step = max(1, PAIRS_COMPARED // max(1, len(alone)))
    for begin in range(0, len(alone), step):
        here, there = ties[begin : begin + step, None], walls[begin : begin + step, None]
        tied = (here >= 0.0) & (ties >= 0.0)
        one_wall = np.where(there == walls, 1.0, np.where(tied, np.exp(-np.abs(here - ties)), 0.0))
        together[begin : begin + step] = one_wall @ alone
    weights: Floats = alone / (1.0 + wall_sigma**2 * together)
    return np.where(weights >= MIN_WEIGHT, weights, 0.0)


def _not_shown_before(given: Correspondences, rows: Indices) -> Floats:
    """Return the fraction of each scan segment that no longer one of its line covers, (n,), of equal ones the first."""
    fractions = np.ones(len(rows))
    for row in np.flatnonzero(np.bincount(rows) > 1).tolist():
        members = np.flatnonzero(rows == row)
        members = members[np.argsort(-given.lengths[members], kind="stable")]
        along = given.directions[members[0]]
        middles, reach = given.midpoints[members] @ along, 0.5 * given.lengths[members]
        edges = np.unique(np.concatenate([middles - reach, middles + reach]))
        free = np.diff(edges)
        for member, low, high in zip(members.tolist(), middles - reach, middles + reach, strict=True):
            own = slice(*np.searchsorted(edges, (low, high)).tolist())
            fractions[member] = float(free[own].sum()) / max(high - low, MIN_EXTENT)
            free[own] = 0.0
    return fractions


def correspondences(index: MapIndex, accepted: Accepted, registered: RegistrationResult) -> tuple[Correspondence, ...]:
    """Report the consensus set by scan index."""
    columns = (accepted.overlaps, registered.offsets, registered.angles, registered.weights)
    values = (column.tolist() for column in columns)
    return tuple(map(Correspondence, accepted.scan_indices, accepted.map_indices(index), *values, accepted.others))
