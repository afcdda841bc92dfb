"""From the matches on walls to correspondences with the map's own segments."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from registration import RegistrationOptions, RegistrationResult, RigidTransform, register

from ._accept_kernels import accept_matches
from .map_index import MapIndex
from .options import AssociationOptions, Estimator, Rotation, Scan
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
    overlaps : (n,) share of each scan segment's length that lies on pieces of its wall, or run where it is long
    rivals, rival_starts : pair k lies also on the pieces ``rivals[rival_starts[k]:rival_starts[k + 1]]``
    """

    pairs: Indices
    overlaps: Floats
    rivals: Indices
    rival_starts: Indices


def accept(index: MapIndex, scan: Scan, rows: ScanRows, best: Ranked) -> Accepted:
    """Pick for every matched scan segment the piece of its wall that it lies on most; ties by index."""
    pose = best.pose
    found = accept_matches(
        best.matches, rows.order, scan.measured.segments.endpoints, pose.theta, pose.x, pose.y, index.walls.rows,
        index.pieces, index.piece_starts, index.endpoints,
    )  # fmt: skip
    return Accepted(*found)


def register_accepted(
    index: MapIndex, scan: Scan, accepted: Accepted, options: AssociationOptions
) -> RegistrationResult | None:
    """Fit the pose to a consensus set, as `/v1/register` would; None without pairs."""
    if not len(accepted.pairs):
        return None
    return register(
        index.segments, scan.measured, accepted.pairs, index.sigma, _how(options.estimator, options.rotation)
    )


@lru_cache
def _how(estimator: Estimator, rotation: Rotation) -> RegistrationOptions:
    return RegistrationOptions(estimator=estimator, rotation=rotation)


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
    scans, maps = accepted.pairs[:, 0].tolist(), (accepted.pairs[:, 1] % index.directed).tolist()
    rivals, starts = (accepted.rivals % index.directed).tolist(), accepted.rival_starts.tolist()
    columns = (accepted.overlaps, registered.offsets, registered.angles, registered.weights)
    alternatives = (tuple(rivals[begin:end]) for begin, end in pairwise(starts))
    return tuple(map(Correspondence, scans, maps, *(column.tolist() for column in columns), alternatives))
