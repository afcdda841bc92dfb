"""The scale of scans: the fraction by which their lengths are off from those of the map."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from association import AssociationResult, Scan
from registration import Correspondences, RigidTransform, Segments

SCALE_PRIOR, RANGE_PRIOR = 0.1, 0.05  # of the fraction, and of an error of all ranges in m: usual values


@dataclass(frozen=True, slots=True)
class Matched:
    """A scan at its pose on a map, map_from_scan, and its correspondences."""

    scan: Scan
    pose: RigidTransform
    pairs: Correspondences

    @classmethod
    def of(cls, segments: Segments, scan: Scan, result: AssociationResult) -> Matched | None:
        """Return a scan with its answer on the map of these segments; None where nothing was matched."""
        if result.pose is None or not result.correspondences:
            return None
        pairs = [(one.scan, one.map) for one in result.correspondences]
        return cls(scan, result.pose, Correspondences.of(segments, scan.measured, pairs))


def scale_of(found: Iterable[Matched], sigma: float) -> tuple[float, float]:
    """Estimate the fraction by which the lengths of scans are off from those of the map.

    The offset of a scan line from its wall is ``q s + k b + g . d`` with its lever arm ``q`` along the wall's normal,
    the fraction ``s``, the cosine ``k`` between ray and normal, an error ``b`` of all ranges, and the error ``d`` of
    the pose. Poses are marginal: only walls of one direction at several distances show the scale.

    Parameters
    ----------
    found : iterable of Matched
    sigma : float
        Standard deviation of the map's lines, metres.

    Returns
    -------
    float
        The fraction, above 0 where ranges are too long.
    float
        Its standard deviation.
    """
    # Without the prior of the range error, that and the scale cannot be separated in square rooms.
    information, right = np.diag([1.0 / SCALE_PRIOR**2, 1.0 / RANGE_PRIOR**2]), np.zeros(2)
    square, count = 0.0, 0
    for one in found:
        pairs, c, s = one.pairs, math.cos(one.pose.theta), math.sin(one.pose.theta)
        turn, normals = np.array([[c, s], [-s, c]]), pairs.map_normals
        viewed, turned = (pairs.midpoints - np.asarray(one.scan.viewpoint or (0.0, 0.0))) @ turn, pairs.midpoints @ turn
        offsets = np.einsum("ij,ij->i", normals, turned + np.array([one.pose.x, one.pose.y])) - pairs.map_offsets
        arms = np.einsum("ij,ij->i", normals, viewed)
        scale = np.column_stack([arms, arms / np.maximum(np.hypot(*viewed.T), 1e-6)])
        pose = np.column_stack([normals, normals[:, 1] * turned[:, 0] - normals[:, 0] * turned[:, 1]])
        weight = 1.0 / (pairs.variances + sigma**2)
        own = (pose * weight[:, None]).T @ pose + 1e-3 * np.eye(3)
        gain = np.linalg.solve(own, (pose * weight[:, None]).T @ np.column_stack([scale, offsets]))
        both = (scale * weight[:, None]).T @ np.column_stack([scale, offsets, pose])
        information += both[:, :2] - both[:, 3:] @ gain[:, :2]
        right += both[:, 2] - both[:, 3:] @ gain[:, 2]
        square += float(weight @ offsets**2 - ((weight * offsets) @ pose) @ gain[:, 2])
        count += len(offsets) - 3
    covariance = np.linalg.inv(information)
    solution = covariance @ right
    inflation = max(1.0, (square - float(right @ solution)) / max(1, count))
    return float(solution[0]), math.sqrt(covariance[0, 0] * inflation)
