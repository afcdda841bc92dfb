"""The scale of scans: the fraction by which their lengths are off from those of the map."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from association import AssociationResult, Scan
from registration import IDENTITY, Correspondences, Segments

SCALE_PRIOR, RANGE_PRIOR, WALL_PRIOR = 0.1, 0.05, 0.2  # usual values of a fraction, and m of ranges and of walls
LINE_FLOOR = 0.001  # m; errors of the lines of one scan that do not average out
FREE_POSE = 30.0  # m, and rad; deviation of a pose of which nothing is known
AGREEING = 3.0  # deviations
LEAST_SHARE = 0.5  # of a scan's length, tables; that has to match before its walls show how far they are off

Floats = NDArray[np.float64]


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
    """A scan with its answer, which has a pose, and the correspondences of that."""

    scan: Scan
    result: AssociationResult
    pairs: Correspondences

    @classmethod
    def of(cls, segments: Segments, scan: Scan, result: AssociationResult) -> Matched | None:
        """Return a scan with its answer on the map of these segments; None where too little of the scan fits."""
        if result.pose is None or not fits(result):
            return None
        return cls(scan, result, pairs_of(segments, scan, result))


@dataclass(frozen=True, slots=True)
class Errors:
    """Scale, and the error that all walls or ranges share, by the correspondences of scans.

    Attributes
    ----------
    scale, scale_deviation : float
        Fraction by which the lengths of the scans are off from those of the map, above 0 where ranges are too long.
    offset, offset_deviation : float
        Metres by which all ranges are too long or, `of_walls`, all walls are nearer to the sensor than drawn.
    drawn_deviation : float
        Of the scale relative to the map as it is drawn; more scans make it smaller, whatever the walls are off by.
    """

    scale: float
    scale_deviation: float
    offset: float
    offset_deviation: float
    drawn_deviation: float


def errors_of(found: Sequence[Matched], sigma: float, *, of_walls: bool = False) -> Errors:
    """Estimate the errors that scans share, their poses and the errors of the walls being marginal.

    The offset of a scan line from its wall is ``q s + k b + w + g . d`` with its lever arm ``q`` along the wall's
    normal, the fraction ``s``, the cosine ``k`` between ray and normal, an error ``b`` of all ranges, the error ``w``
    of the wall, which is the same in all scans, and the error ``d`` of the pose. Only walls of one direction at several
    distances show the scale.

    Parameters
    ----------
    found : sequence of Matched
    sigma : float
        Standard deviation of the map's lines, metres.
    of_walls : bool
        True if all walls are off along their normal, and not the ranges: ``k`` is then -1 or 1.
    """
    lines = [_lines(one, of_walls) for one in found]
    errors, pose, offsets, variances = (np.concatenate(part) for part in zip(*lines, strict=True))
    on = np.concatenate([[pair.map for pair in one.result.correspondences] for one in found])
    walls, wall = np.unique(on, return_inverse=True)
    scan = np.repeat(np.arange(len(found)), [len(one.pairs) for one in found])
    of_wall, of_pose = sparse(np.full((len(on), 1), sigma), wall, len(walls)), sparse(pose, scan, 3 * len(found))
    unknown = scipy.sparse.hstack([scipy.sparse.csr_array(errors), of_wall, of_pose])
    # Without the prior of the range error, that and the scale cannot be separated in square rooms.
    usual = WALL_PRIOR if of_walls else RANGE_PRIOR
    prior = np.r_[SCALE_PRIOR, usual, np.ones(len(walls)), np.full(3 * len(found), FREE_POSE)] ** -2.0
    weight = 1.0 / (variances + LINE_FLOOR**2)
    weighted = scipy.sparse.diags_array(weight) @ unknown
    normal = (weighted.T @ unknown + scipy.sparse.diags_array(prior)).tocsc()
    solved = scipy.sparse.linalg.splu(normal)
    solution = solved.solve(weighted.T @ offsets)
    square = float((weight * offsets) @ (offsets - unknown @ solution))
    inflation = max(1.0, square / max(1, len(on) - 3 * len(found)))
    scale, offset = np.sqrt(np.diag(solved.solve(np.eye(len(prior), 2))) * inflation)
    fixed = np.r_[:2, 2 + len(walls) : len(prior)]
    drawn = scipy.sparse.linalg.splu(normal[fixed][:, fixed]).solve(np.eye(len(fixed), 1))[0, 0] * inflation
    return Errors(float(solution[0]), float(scale), float(solution[1]), float(offset), math.sqrt(drawn))


def _lines(one: Matched, of_walls: bool) -> tuple[Floats, Floats, Floats, Floats]:
    """Return derivatives by the shared errors (n, 2) and by the pose (n, 3), offsets and variances of scan lines."""
    pairs, at = one.pairs, one.result.pose or IDENTITY
    c, s = math.cos(at.theta), math.sin(at.theta)
    turn, normals = np.array([[c, s], [-s, c]]), pairs.map_normals
    viewed, turned = (pairs.midpoints - np.asarray(one.scan.viewpoint or (0.0, 0.0))) @ turn, pairs.midpoints @ turn
    offsets = np.einsum("ij,ij->i", normals, turned + np.array([at.x, at.y])) - pairs.map_offsets
    arms = np.einsum("ij,ij->i", normals, viewed)
    shared = -np.sign(arms) if of_walls else arms / np.maximum(np.hypot(*viewed.T), 1e-6)
    pose = np.column_stack([normals, normals[:, 1] * turned[:, 0] - normals[:, 0] * turned[:, 1]])
    return np.column_stack([arms, shared]), pose, offsets, pairs.variances


def sparse(rows: Floats, block: NDArray[np.intp], columns: int) -> scipy.sparse.csr_array:
    """Return a sparse matrix whose rows have their values in one block of columns each."""
    count, width = rows.shape
    at = width * block[:, None] + np.arange(width)
    return scipy.sparse.csr_array((rows.ravel(), at.ravel(), width * np.arange(count + 1)), shape=(count, columns))


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
