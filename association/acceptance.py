"""From the matches on walls to correspondences with the map's own segments."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from registration import RegistrationOptions, RegistrationResult, RigidTransform, register
from registration.values import value

from .context import SearchContext
from .kernels.acceptance import accept_matches
from .map_index import MapIndex
from .options import Estimator, Rotation
from .ranking import Ranked
from .result import Correspondence
from .settling import Settled
from .tables import Lines

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


@value(frozen=True, slots=True)
class Accepted:
    """A consensus set in the map's own segments.

    Attributes
    ----------
    pairs : (n, 2) scan index and index of the map piece, by scan index
    overlaps : (n,) share of each scan segment's length that lies on pieces of its wall, or run where it is long
    rivals, rival_starts : pair k lies also on the pieces ``rivals[rival_starts[k]:rival_starts[k + 1]]``
    """

    pairs: Indices
    overlaps: Floats
    rivals: Indices
    rival_starts: Indices

    @property
    def scan_indices(self) -> list[int]:
        """Scan index of each pair."""
        indices: list[int] = self.pairs[:, 0].tolist()
        return indices

    def map_indices(self, index: MapIndex) -> list[int]:
        """Return the map index of each pair, as sent."""
        indices: list[int] = (self.pairs[:, 1] % index.directed).tolist()
        return indices


def accept(context: SearchContext, best: Ranked) -> Accepted:
    """Pick for every matched scan segment the piece of its wall that it lies on most; ties by index."""
    index, ends = context.index, context.ends
    lines = Lines(context.lines.rows, context.lines.row_of, float(context.gates["least_overlap"][0]))
    found = accept_matches(best.matches, lines, ends, best.estimate, index.walls.rows, index.pieces)
    return Accepted(*found)


def overlaps_at(context: SearchContext, best: Ranked, accepted: Accepted, pose: RigidTransform) -> Floats:
    """Return the share of each accepted segment's length that lies on its wall, or run, at a pose in the map, (n,)."""
    index, ends = context.index, context.ends
    at = best.estimate.copy()
    at["x"], at["y"], at["theta"] = pose.x - index.origin[0], pose.y - index.origin[1], pose.theta
    every = Lines(context.lines.rows, context.lines.row_of, 0.0)  # however little of a segment lies there
    pairs, overlaps, _, _ = accept_matches(best.matches, every, ends, at, index.walls.rows, index.pieces)
    shares: Floats = overlaps[np.searchsorted(pairs[:, 0], accepted.pairs[:, 0])]
    return shares


def register_accepted(context: SearchContext, accepted: Accepted, settled: Settled) -> RegistrationResult | None:
    """Evaluate the settled pose on the pairs, walls off as they are there; None without pairs.

    The paper's estimator fits a pose of its own to the same pairs.
    """
    if not len(accepted.pairs):
        return None
    index, options = context.index, context.options
    how = _how(options.estimator, options.rotation)
    at = context.in_map(settled.pose) if options.estimator == "joint" else None
    return register(index.segments, context.scan.measured, accepted.pairs, settled.wall_sigma, how, at)


@lru_cache
def _how(estimator: Estimator, rotation: Rotation) -> RegistrationOptions:
    return RegistrationOptions(estimator=estimator, rotation=rotation)


def correspondences(
    index: MapIndex, accepted: Accepted, overlaps: Floats, registered: RegistrationResult
) -> tuple[Correspondence, ...]:
    """Report the consensus set by scan index, with the overlaps that are told of it, (n,)."""
    rivals, starts = (accepted.rivals % index.directed).tolist(), accepted.rival_starts.tolist()
    columns = (overlaps, registered.offsets, registered.angles, registered.weights)
    alternatives = (tuple(rivals[begin:end]) for begin, end in pairwise(starts))
    values = (column.tolist() for column in columns)
    return tuple(map(Correspondence, accepted.scan_indices, accepted.map_indices(index), *values, alternatives))
