"""The candidates in order: refined, scored with the lines of sight and the prior, and distinct."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform, wrap_angle

from ._search_kernels import INSIDE, prior_value
from ._sight_kernels import rank
from .candidates import DISTINCT_ANGLE, DISTINCT_DISTANCE, Candidates, encode_prior
from .map_index import MapIndex
from .options import AssociationOptions, Prior, Scan
from .scan_rows import ScanRows, gates

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Ranked:
    """One explanation of the scan.

    Attributes
    ----------
    pose : RigidTransform
        Index frame from scan frame.
    covariance : (3, 3)
        Of additive (x, y, theta), with the model's slack in it.
    score : float
        Log-likelihood over that of a scan that is all clutter, nats; without the prior.
    value : float
        Score and prior together.
    inside : bool
        Whether it lies within a hard prior's window; True without one.
    share : float
        Of the scan's length that is matched.
    length : float
        Of the matched segments together, metres.
    reliability : float
        Eq. (28).
    matches : (n, 5)
        By row of the scan, see `_match_kernels`.
    """

    pose: RigidTransform
    covariance: Floats
    score: float
    value: float
    inside: bool
    share: float
    length: float
    reliability: float
    matches: Floats


def rank_candidates(
    index: MapIndex, scan: Scan, rows: ScanRows, candidates: Candidates, priors: tuple[Prior | None, AssociationOptions]
) -> list[Ranked]:
    """Refine and order the candidates: within the prior's window first, then by value; ties by the search's order."""
    prior, options = priors
    k, n = len(candidates.poses), len(rows.rows)
    poses = candidates.poses.copy()
    scores, shares, reliabilities = np.zeros(k), np.zeros(k), np.zeros(k)
    covariances, matches = np.zeros((k, 3, 3)), np.zeros((k, n, 5))
    viewpoint = np.array(scan.viewpoint if scan.viewpoint is not None else (0.0, 0.0))
    rank(
        rows.rows, poses, index.walls.rows, index.grid.starts, index.grid.items, index.grid.shape, gates(options),
        viewpoint, scan.viewpoint is not None, scores, covariances, shares, reliabilities, matches,
    )  # fmt: skip
    flat = encode_prior(prior, index.origin)
    values = scores + np.array([prior_value(flat, *pose) for pose in poses])
    ranked: list[Ranked] = []
    for i in np.lexsort((np.arange(k), -values)):
        theta, x, y = (float(v) for v in poses[i])
        pose = RigidTransform(x, y, theta)
        if scores[i] <= 0.0 or any(_same(pose, other.pose) for other in ranked):
            continue
        inside = flat[0] != 2.0 or values[i] >= INSIDE / 2
        value = float(values[i] if values[i] < INSIDE / 2 else scores[i])
        ranked.append(
            Ranked(
                pose=pose,
                covariance=covariances[i],
                score=float(scores[i]),
                value=value,
                inside=bool(inside),
                share=float(shares[i]),
                length=float(rows.rows[matches[i, :, 0] >= 0.0, 4].sum()),
                reliability=float(reliabilities[i]),
                matches=matches[i],
            )
        )
    return ranked


def _same(a: RigidTransform, b: RigidTransform) -> bool:
    near = math.hypot(a.x - b.x, a.y - b.y) < DISTINCT_DISTANCE
    return near and abs(wrap_angle(a.theta - b.theta)) < DISTINCT_ANGLE
