"""The position of walls from all scans together: the joint estimator over poses and walls, poses marginal.

A pair of a scan line and a wall has two residuals, to first order in the pose ``(x, y, theta)`` of its scan, and in the
offset ``c`` and the tilt ``phi`` of its wall::

    r + n . (dx, dy) + n . (R m)_perp dtheta - c - s phi   of variance sigma^2 / points
    e + dtheta - phi                                       of variance sigma^2 / (points spread)

with the map line's normal ``n``, the centroid ``m`` of the scan line, and its place ``s`` along the wall. The map's
declared sigma is the prior of the walls. The normal equations are summed scan by scan, and the Schur complement takes
each pose out: a pose that hangs on one wall tells nothing of that wall.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from association import Deadline, MapIndex
from registration import Segments

from ..scale import LINE_FLOOR, pairs_of, sparse
from . import tuning
from .result import Bools, Floats, Indices, Sharpened
from .scans import Localized, blocks, go_on


@dataclass(frozen=True, slots=True, eq=False)
class _Pairs:
    """Pairs of scan lines and walls of all scans: rows of the normal equations, two for each pair.

    Attributes
    ----------
    scan, wall : (m,)
        Number of the scan, and of the wall.
    of_pose, of_wall : (m, 3), (m, 2)
        Derivatives by pose and by wall.
    residual, variance : (m,)
    """

    scan: Indices
    wall: Indices
    of_pose: Floats
    of_wall: Floats
    residual: Floats
    variance: Floats


def sharpen(index: MapIndex, found: Sequence[Localized], sigma: float, deadline: Deadline) -> Sharpened:
    """Estimate the position of the walls that many scans see.

    Parameters
    ----------
    index : MapIndex
        That the scans were searched in.
    found : sequence of Localized
        Scans that give evidence; of more than `MOST_POSES` as many, evenly chosen.
    sigma : float
        Declared standard deviation of the map's lines, metres.
    deadline : Deadline

    Returns
    -------
    Sharpened
        Of walls that several visits and places see, and whose position becomes clearly better known.
    """
    found = found[:: max(1, math.ceil(len(found) / tuning.MOST_POSES))]
    known = Segments.derived(index.segments.endpoints[: index.directed])
    wall_of = np.array(index.wall_of_piece[: index.directed], dtype=np.intp)
    seen = np.unique([pair.map for one in found for pair in one.result.correspondences]).astype(np.intp)
    pieces = np.flatnonzero(np.isin(wall_of, wall_of[seen]))
    own, (walls, number) = known.take(pieces), np.unique(wall_of[pieces], return_inverse=True)
    middles, lengths = _extents(own, number, len(walls))
    wall_of[pieces] = number  # those that no scan sees stay as they are
    pairs = _pairs_of(known, wall_of, middles, found)
    prior = np.stack([np.full(len(walls), sigma), np.minimum(tuning.MOST_TILT, 2.0 * sigma / lengths)], axis=1)
    shift, covariance = _solve(pairs, prior, deadline)
    spread = _deviations(own, number, middles, covariance)
    widest = np.zeros(len(walls))
    np.maximum.at(widest, number, spread)
    better = _seen_often(pairs, found, len(walls)) & (widest <= tuning.SHARPER * sigma)
    mine = np.flatnonzero(better[number])
    return Sharpened(pieces[mine], _moved(own, number, middles, shift)[mine], spread[mine])


def _extents(known: Segments, wall_of: Indices, count: int) -> tuple[Floats, Floats]:
    """Return the middle (n, 2) of each wall, weighted by its pieces, and its length (n,), gaps included."""
    weight = np.bincount(wall_of, known.lengths, count)
    middles = np.stack([np.bincount(wall_of, known.lengths * known.midpoints[:, k], count) / weight for k in (0, 1)], 1)
    reach = [np.einsum("ij,ij->i", known.endpoints[:, k : k + 2] - middles[wall_of], known.directions) for k in (0, 2)]
    low, high = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(low, wall_of, np.minimum(*reach))
    np.maximum.at(high, wall_of, np.maximum(*reach))
    return middles, np.maximum(high - low, 1e-3)


def _pairs_of(known: Segments, wall_of: Indices, middles: Floats, found: Sequence[Localized]) -> _Pairs:
    """Return the rows of all pairs, those of offsets before those of angles in each scan."""
    parts: list[_Pairs] = []
    for number, one in enumerate(found):
        pairs = pairs_of(known, one.scan, one.result)
        on = np.array([pair.map for pair in one.result.correspondences], dtype=np.intp)
        wall, normals = wall_of[on], known.normals[on]
        c, s = np.cos(one.pose.theta), np.sin(one.pose.theta)
        turned = pairs.centroids @ np.array([[c, s], [-s, c]])
        places = turned + np.array([one.pose.x, one.pose.y])
        lever = normals[:, 1] * turned[:, 0] - normals[:, 0] * turned[:, 1]
        along = np.einsum("ij,ij->i", places - middles[wall], known.directions[on])
        scan, zero, one_ = np.full(len(on), number), np.zeros(len(on)), np.ones(len(on))
        offset = np.einsum("ij,ij->i", normals, places) - known.offsets[on]
        angle = -np.array([pair.angle for pair in one.result.correspondences])
        angle = np.remainder(angle + 0.5 * np.pi, np.pi) - 0.5 * np.pi  # a map without directions has either
        moved, turned_by = np.column_stack([normals, lever]), np.column_stack([zero, zero, one_])
        aside, tilted = np.column_stack([one_, along]), np.column_stack([zero, one_])
        noise = pairs.variances + LINE_FLOOR**2
        angle_noise = pairs.variances / np.maximum(pairs.spreads, 1e-6) + tuning.ANGLE_FLOOR**2
        parts.append(_Pairs(scan, wall, moved, aside, offset, noise))
        parts.append(_Pairs(scan, wall, turned_by, tilted, angle, angle_noise))
    return _Pairs(*(np.concatenate([getattr(part, name) for part in parts]) for name in _Pairs.__slots__))


def _solve(pairs: _Pairs, prior: Floats, deadline: Deadline) -> tuple[Floats, Floats]:
    """Return the shift of each wall, offset and tilt (n, 2), and its covariance (n, 2, 2); poses are marginal.

    The walls, each a block of its own, are taken out first: the dense matrix that remains has the size of the poses.
    """
    go_on(deadline)
    weight, numbers = 1.0 / pairs.variance, np.unique(pairs.scan, return_inverse=True)[1]
    size = 3 * (int(numbers.max(initial=-1)) + 1)
    of_wall = sparse(pairs.of_wall, pairs.wall, prior.size)
    of_pose = sparse(pairs.of_pose, numbers, size)
    at_wall, at_pose = of_wall.T @ (weight * pairs.residual), of_pose.T @ (weight * pairs.residual)
    blocks_of = np.zeros((len(prior), 2, 2))
    np.add.at(blocks_of, pairs.wall, (weight[:, None] * pairs.of_wall)[:, :, None] * pairs.of_wall[:, None, :])
    own = np.linalg.inv(blocks_of + np.square(1.0 / prior)[:, :, None] * np.eye(2))
    inverse = scipy.sparse.bsr_array((own, np.arange(len(own)), np.arange(len(own) + 1)))
    weighted = scipy.sparse.diags_array(weight) @ of_pose
    both = (of_wall.T @ weighted).tocsr()
    gain = (inverse @ both).tocsr()
    free = np.diag(np.tile(1.0 / np.square(tuning.FREE_POSE), size // 3))
    of_poses = np.linalg.inv(free + (of_pose.T @ weighted - both.T @ gain).toarray())
    shift = inverse @ at_wall - gain @ (of_poses @ (at_pose - gain.T @ at_wall))
    covariance = np.empty((len(prior), 2, 2))
    for part in blocks(len(prior), 2 * size, deadline):
        rows = gain[2 * part.start : 2 * part.stop]
        through, direct = (np.asarray(one).reshape(-1, 2, size) for one in (rows @ of_poses, rows.toarray()))
        covariance[part] = own[part] + np.einsum("kis,kjs->kij", through, direct)
    return np.asarray(shift).reshape(-1, 2), covariance


def _deviations(known: Segments, wall_of: Indices, middles: Floats, covariance: Floats) -> Floats:
    """Return the standard deviation of each segment normal to itself, the root mean square along it, (n,) metres."""
    at = np.einsum("ij,ij->i", known.midpoints - middles[wall_of], known.directions)
    own = covariance[wall_of]
    square = own[:, 0, 0] + 2.0 * at * own[:, 0, 1] + (at**2 + known.lengths**2 / 12.0) * own[:, 1, 1]
    return np.asarray(np.sqrt(np.maximum(square, 0.0)))


def _seen_often(pairs: _Pairs, found: Sequence[Localized], count: int) -> Bools:
    """Return which walls are seen on several visits and from several places, (n,)."""
    often, visits = np.ones(count, dtype=bool), [(one.visit,) for one in found]
    for least, of_scan in ((tuning.LEAST_VISITS, visits), (tuning.LEAST_POSES, [one.place for one in found])):
        numbers = np.unique(of_scan, axis=0, return_inverse=True)[1].ravel()
        seen = np.unique(np.stack([pairs.wall, numbers[pairs.scan]]), axis=1)[0]
        often &= np.bincount(seen, minlength=count) >= least
    return often


def _moved(known: Segments, wall_of: Indices, middles: Floats, shift: Floats) -> Floats:
    """Return the ends of the segments of walls that are shifted and tilted, (n, 4)."""
    out = known.endpoints.copy()
    for k in (0, 2):
        along = np.einsum("ij,ij->i", known.endpoints[:, k : k + 2] - middles[wall_of], known.directions)
        out[:, k : k + 2] += (shift[wall_of, 0] + shift[wall_of, 1] * along)[:, None] * known.normals
    return out
