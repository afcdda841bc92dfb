"""The scale of scans: the fraction by which their lengths are off from those of the map."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from association import AssociationResult, Scan
from registration import Correspondences, RigidTransform, Segments

SCALE_PRIOR, RANGE_PRIOR, WALL_PRIOR = 0.1, 0.05, 0.2  # usual values of a fraction, and m of ranges and of walls
AGREEING = 3.0  # deviations
LEAST_SHARE = 0.5  # of a scan's length, tables; that has to match before its walls show how far they are off


def pairs_of(segments: Segments, scan: Scan, result: AssociationResult) -> Correspondences:
    """Return the correspondences of an answer, by scan segment, with the segments of the map of the search."""
    pairs = [(one.scan, one.map) for one in result.correspondences]
    return Correspondences.of(segments, scan.measured, np.array(pairs, dtype=np.intp).reshape(-1, 2))


def fits(result: AssociationResult) -> bool:
    """Return whether an answer is usable, or explains enough of its scan to show how far walls are off."""
    diagnostics = result.diagnostics
    return result.usable or (diagnostics is not None and diagnostics.inlier_fraction >= LEAST_SHARE)


@dataclass(frozen=True, slots=True)
class Matched:
    """A scan at its pose on a map, map_from_scan, and its correspondences."""

    scan: Scan
    pose: RigidTransform
    pairs: Correspondences

    @classmethod
    def of(cls, segments: Segments, scan: Scan, result: AssociationResult) -> Matched | None:
        """Return a scan with its answer on the map of these segments; None where too little of the scan fits."""
        if result.pose is None or not fits(result):
            return None
        return cls(scan, result.pose, pairs_of(segments, scan, result))


@dataclass(frozen=True, slots=True)
class Errors:
    """Scale, and the error that all walls or ranges share, by the correspondences of scans.

    Attributes
    ----------
    scale, scale_deviation : float
        Fraction by which the lengths of the scans are off from those of the map, above 0 where ranges are too long.
    offset, offset_deviation : float
        Metres by which all ranges are too long or, `of_walls`, all walls are nearer to the sensor than drawn.
    """

    scale: float
    scale_deviation: float
    offset: float
    offset_deviation: float


def errors_of(found: Iterable[Matched], sigma: float, *, of_walls: bool = False) -> Errors:
    """Estimate the errors that scans share, their poses being marginal.

    The offset of a scan line from its wall is ``q s + k b + g . d`` with its lever arm ``q`` along the wall's normal,
    the fraction ``s``, the cosine ``k`` between ray and normal, an error ``b`` of all ranges, and the error ``d`` of
    the pose. Only walls of one direction at several distances show the scale.

    Parameters
    ----------
    found : iterable of Matched
    sigma : float
        Standard deviation of the map's lines, metres.
    of_walls : bool
        True if all walls are off along their normal, and not the ranges: ``k`` is then -1 or 1.
    """
    # Without the prior of the range error, that and the scale cannot be separated in square rooms.
    information = np.diag([SCALE_PRIOR**-2, (WALL_PRIOR if of_walls else RANGE_PRIOR) ** -2])
    right, square, count = np.zeros(2), 0.0, 0
    for one in found:
        pairs, c, s = one.pairs, math.cos(one.pose.theta), math.sin(one.pose.theta)
        turn, normals = np.array([[c, s], [-s, c]]), pairs.map_normals
        viewed, turned = (pairs.midpoints - np.asarray(one.scan.viewpoint or (0.0, 0.0))) @ turn, pairs.midpoints @ turn
        offsets = np.einsum("ij,ij->i", normals, turned + np.array([one.pose.x, one.pose.y])) - pairs.map_offsets
        arms = np.einsum("ij,ij->i", normals, viewed)
        shared = -np.sign(arms) if of_walls else arms / np.maximum(np.hypot(*viewed.T), 1e-6)
        errors = np.column_stack([arms, shared])
        pose = np.column_stack([normals, normals[:, 1] * turned[:, 0] - normals[:, 0] * turned[:, 1]])
        weight = 1.0 / (pairs.variances + sigma**2)
        own = (pose * weight[:, None]).T @ pose + 1e-3 * np.eye(3)
        gain = np.linalg.solve(own, (pose * weight[:, None]).T @ np.column_stack([errors, offsets]))
        both = (errors * weight[:, None]).T @ np.column_stack([errors, offsets, pose])
        information += both[:, :2] - both[:, 3:] @ gain[:, :2]
        right += both[:, 2] - both[:, 3:] @ gain[:, 2]
        square += float(weight @ offsets**2 - ((weight * offsets) @ pose) @ gain[:, 2])
        count += len(offsets) - 3
    covariance = np.linalg.inv(information)
    solution = covariance @ right
    inflation = max(1.0, (square - float(right @ solution)) / max(1, count))
    (scale, offset), (scale_deviation, offset_deviation) = solution, np.sqrt(np.diag(covariance) * inflation)
    return Errors(float(scale), float(scale_deviation), float(offset), float(offset_deviation))


@dataclass(frozen=True, slots=True)
class Agreed:
    """An error that scans agree about, its standard deviation, and the number of these scans."""

    value: float = 0.0
    deviation: float = math.inf
    count: int = 0


def agreed(found: Sequence[Matched], sigma: float, error: Literal["scale", "offset"], same: float) -> Agreed:
    """Estimate an error of walls from each scan, and return the mean of those that agree with their weighted median.

    Parameters
    ----------
    found : sequence of Matched
    sigma : float
        Standard deviation of the map's lines, metres.
    error : "scale" or "offset"
        Of `Errors`.
    same : float
        Difference up to which two scans agree whatever their deviations are.
    """
    if not found:
        return Agreed()
    own = [errors_of([one], sigma, of_walls=True) for one in found]
    values, deviations = np.array([[getattr(one, error), getattr(one, f"{error}_deviation")] for one in own]).T
    order, weights = np.argsort(values), deviations**-2.0
    middle = values[order][np.searchsorted(np.cumsum(weights[order]), 0.5 * weights.sum())]
    near = np.abs(values - middle) <= np.maximum(same, AGREEING * deviations)
    weights *= near
    return Agreed(float(weights @ values / weights.sum()), float(weights.sum() ** -0.5), int(near.sum()))
