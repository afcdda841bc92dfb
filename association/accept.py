"""From the matches on walls to correspondences with the map's own segments."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import RegistrationOptions, RegistrationResult, RigidTransform, register

from .map_index import MapIndex
from .options import AssociationOptions, Scan
from .ranking import Ranked
from .result import Correspondence
from .scan_rows import ScanRows

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Accepted:
    """A consensus set in the map's own segments.

    Attributes
    ----------
    pairs : (n, 2) scan index and index of the map piece, by scan index
    overlaps : (n,) share of each scan segment's length that lies on pieces of its wall
    rivals : for each pair the other pieces of its wall that it lies on
    """

    pairs: Indices
    overlaps: Floats
    rivals: tuple[tuple[int, ...], ...]


def accept(index: MapIndex, scan: Scan, rows: ScanRows, best: Ranked) -> Accepted:
    """Pick for every matched scan segment the piece of its wall that it lies on most; ties by index."""
    segments = scan.measured.segments
    walls = index.walls.rows
    matched = np.nonzero(best.matches[:, 0] >= 0.0)[0]
    matched = matched[np.argsort(rows.order[matched])]
    pairs, overlaps, rivals = [], [], []
    ends = best.pose.apply(segments.endpoints.reshape(-1, 2, 2))
    for row in matched:
        i, w = int(rows.order[row]), int(best.matches[row, 0])
        pieces = index.pieces[index.piece_starts[w] : index.piece_starts[w + 1]]
        d = walls[w, :2]
        low, high = float(ends[i, 0] @ d), float(ends[i, 1] @ d)
        low, high = min(low, high), max(low, high)
        along = index.local.endpoints[pieces].reshape(-1, 2, 2) @ d
        first, last = along.min(axis=1), along.max(axis=1)
        covered = np.minimum(last, high) - np.maximum(first, low)
        most = int(np.argmax(covered))
        pairs.append((i, int(pieces[most])))
        overlaps.append(_union(np.maximum(first, low), np.minimum(last, high)) / max(high - low, 1e-9))
        near = [int(p) for p, c in zip(pieces, covered, strict=True) if c > 0.0 and p != pieces[most]]
        rivals.append(tuple(near[:8]))
    return Accepted(np.array(pairs, dtype=np.intp).reshape(-1, 2), np.minimum(1.0, overlaps), tuple(rivals))


def _union(lows: Floats, highs: Floats) -> float:
    """Return the length of a union of intervals."""
    total, reach = 0.0, -math.inf
    for low, high in sorted(zip(lows.tolist(), highs.tolist(), strict=True)):
        if high > max(low, reach):
            total += high - max(low, reach)
            reach = high
    return total


def register_accepted(
    index: MapIndex, scan: Scan, accepted: Accepted, options: AssociationOptions
) -> RegistrationResult | None:
    """Fit the pose to a consensus set, as `/v1/register` would; None without pairs."""
    if not len(accepted.pairs):
        return None
    how = RegistrationOptions(estimator=options.estimator, rotation=options.rotation)
    return register(index.segments, scan.measured, accepted.pairs, index.sigma, how)


def place_on_family(
    index: MapIndex, rows: ScanRows, best: Ranked, registered: RegistrationResult, at: RigidTransform | None
) -> RigidTransform:
    """Choose among poses that differ along the free direction only: nearest to `at`, else the centred one.

    Centred: the middle of what was seen along that direction comes to lie on the middle of the walls that it matched.
    """
    pose = registered.pose
    if pose is None:
        raise ValueError("a family of poses needs one to start from")
    if registered.unobservable is None:
        return pose
    u = np.array(registered.unobservable)
    if at is not None:
        shift = float((np.array([at.x - pose.x, at.y - pose.y])) @ u)
    else:
        matched = best.matches[:, 0] >= 0.0
        walls = index.walls.rows[best.matches[matched, 0].astype(np.intp)]
        ends = walls[:, None, :2] * walls[:, 3:5, None]
        ends = ends + np.stack([-walls[:, 1], walls[:, 0]], axis=1)[:, None] * walls[:, None, 2:3] + index.origin
        seen = rows.rows[matched]
        half = 0.5 * seen[:, 4:5] * seen[:, :2]
        points = pose.apply(np.stack([seen[:, 2:4] - half, seen[:, 2:4] + half], axis=1))
        on_map, on_scan = ends @ u, points @ u
        shift = 0.5 * float(on_map.min() + on_map.max() - on_scan.min() - on_scan.max())
    return RigidTransform(pose.x + shift * float(u[0]), pose.y + shift * float(u[1]), pose.theta)


def correspondences(index: MapIndex, accepted: Accepted, registered: RegistrationResult) -> tuple[Correspondence, ...]:
    """Report the consensus set by scan index."""
    n = index.directed
    return tuple(
        Correspondence(
            scan=int(i),
            map=int(j) % n,
            overlap=float(accepted.overlaps[k]),
            offset=float(registered.offsets[k]),
            angle=float(registered.angles[k]),
            weight=float(registered.weights[k]),
            alternatives=tuple(r % n for r in accepted.rivals[k]),
        )
        for k, (i, j) in enumerate(accepted.pairs)
    )
