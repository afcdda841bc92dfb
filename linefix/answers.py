"""Results for one scan to the JSON documents of the API; the service and the command line answer with these."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from association import (
    NOT_IN_ORDER,
    Alternative,
    AssociationResult,
    AssociationWarning,
    Correspondence,
    CriticalWall,
    MapVerdict,
    message_of,
)
from registration import Ambiguity, RegistrationDiagnostics, RegistrationResult, RigidTransform
from vectorization import Vectorization

Json = dict[str, Any]
Indices = NDArray[np.intp]


def pose_json(pose: RigidTransform | None) -> Json | None:
    """Return a pose, metres and radians."""
    return None if pose is None else {"x": pose.x, "y": pose.y, "theta": pose.theta}


def matrix_json(matrix: NDArray[np.float64] | None) -> list[list[float]] | None:
    """Return a matrix by rows."""
    return None if matrix is None else matrix.tolist()


def direction_json(direction: tuple[float, float] | None) -> list[float] | None:
    """Return a unit vector."""
    return None if direction is None else [float(direction[0]), float(direction[1])]


def ambiguity_json(ambiguity: Ambiguity | None) -> Json | None:
    """Return the parts of an ambiguity and their sum."""
    if ambiguity is None:
        return None
    return {"translation": ambiguity.translation, "rotation": ambiguity.rotation, "total": ambiguity.total}


def diagnostics_json(diagnostics: RegistrationDiagnostics) -> Json:
    """Return the diagnostics of a pose."""
    return {
        "ambiguity": ambiguity_json(diagnostics.ambiguity),
        "ambiguity_before": ambiguity_json(diagnostics.ambiguity_before),
        "ambiguity_at": ambiguity_json(diagnostics.ambiguity_at),
        "similarity": diagnostics.similarity,
        "reliability": diagnostics.reliability,
        "determinant": diagnostics.determinant,
        "chi2": diagnostics.chi2,
        "dof": diagnostics.dof,
        "rms_offset": diagnostics.rms_offset,
        "rms_angle": diagnostics.rms_angle,
        "pairs": diagnostics.pairs,
    }


def registration_json(
    result: RegistrationResult, pairs: NDArray[np.intp], listed: Callable[[Iterable[Json]], Any] = list
) -> Json:
    """Return the answer of a registration.

    Parameters
    ----------
    result : RegistrationResult
    pairs : (k, 2)
        Indices of scan and map segment of each correspondence.
    listed : callable
        Makes a list of the residuals, which are many; or what is written as a list.
    """
    columns = (result.offsets.tolist(), result.angles.tolist(), result.weights.tolist())
    return {
        "status": "degenerate" if result.degenerate else "ok",
        "usable": result.usable,
        "pose": pose_json(result.pose),
        "covariance": matrix_json(result.covariance),
        "unobservable": direction_json(result.unobservable),
        "residuals": listed(
            {"scan": scan, "map": on, "offset": offset, "angle": angle, "weight": weight}
            for (scan, on), offset, angle, weight in zip(pairs.tolist(), *columns, strict=True)
        ),
        "diagnostics": diagnostics_json(result.diagnostics),
    }


@dataclass(frozen=True, slots=True)
class _Names:
    """Names of the segments of a scan: the index, or of several views the view and the index in it."""

    starts: Indices | None

    def fields(self, scan: int) -> Json:
        if self.starts is None:
            return {"scan": scan}
        view = int(np.searchsorted(self.starts, scan, side="right")) - 1
        return {"view": view, "scan": scan - int(self.starts[view])}

    def listed(self, scans: Sequence[int]) -> list[Any]:
        return list(scans) if self.starts is None else [self.fields(scan) for scan in scans]


def correspondence_json(pair: Correspondence, named: _Names) -> Json:
    """Return an accepted pair."""
    return {
        **named.fields(pair.scan),
        "map": pair.map,
        "overlap": pair.overlap,
        "offset": pair.offset,
        "angle": pair.angle,
        "weight": pair.weight,
        "alternatives": list(pair.alternatives),
    }


def alternative_json(other: Alternative) -> Json:
    """Return another pose."""
    return {
        "pose": pose_json(other.pose),
        "covariance": matrix_json(other.covariance),
        "score": other.score,
        "ambiguity": ambiguity_json(other.ambiguity),
        "reliability": other.reliability,
        "inlier_fraction": other.inlier_fraction,
        "probability": other.probability,
        **({} if other.map_id is None else {"map_id": other.map_id}),
    }


def map_verdict_json(one: MapVerdict) -> Json:
    """Return the best pose on one of several maps."""
    return {
        "map_id": one.map_id,
        "status": str(one.status),
        "score": one.score,
        "probability": one.probability,
        "pose": pose_json(one.pose),
    }


def critical_wall_json(wall: CriticalWall | None, named: _Names) -> Json | None:
    """Return the wall whose removal would move the pose most."""
    if wall is None:
        return None
    return {
        "scan": named.listed(wall.scan),
        "map": list(wall.map),
        "direction": list(wall.direction),
        "displacement": wall.displacement,
    }


@dataclass(frozen=True, slots=True)
class Included:
    """Fields of an answer that come from the request and its map.

    Attributes
    ----------
    parts : frozenset of str
        Names of the requested parts, as in ``include``.
    frame_id, child_frame_id : str
        Of the map and of the scan.
    stamp : JSON
        Of the scan, as sent.
    segments : list or None
        Of the scan, where the caller sent ranges or points: rows of four numbers, metres; of several views one list or
        None each.
    starts : (v,) or None
        Index of the first segment of each view; segments are then named by view and index. None: a single view.
    """

    parts: frozenset[str]
    frame_id: str
    child_frame_id: str
    stamp: Any = None
    segments: list[Any] | None = None
    starts: Indices | None = None


def association_json(result: AssociationResult, included: Included) -> Json:
    """Return the answer of a search as JSON, with the parts that are included."""
    named, parts = _Names(included.starts), included.parts
    diagnostics = result.diagnostics
    search = result.search
    answer: Json = {
        "status": str(result.status),
        "usable": result.usable,
        "probability": result.probability,
        "message": message_of(result),
        "pose": pose_json(result.pose),
        "covariance": matrix_json(result.covariance),
        "unobservable": direction_json(result.unobservable),
        "unmatched_scan": named.listed(result.unmatched_scan),
        "diagnostics": None
        if diagnostics is None
        else {
            **diagnostics_json(diagnostics.registration),
            "inlier_fraction": diagnostics.inlier_fraction,
            "score": diagnostics.score,
            "runner_up": diagnostics.runner_up,
            "margin": diagnostics.margin,
            "critical_wall": critical_wall_json(diagnostics.critical_wall, named),
            "corrections": None if diagnostics.corrections is None else asdict(diagnostics.corrections),
            "turn_rate": diagnostics.turn_rate,
        },
        "reasons": [{"code": reason.code, "message": reason.message} for reason in result.reasons],
        "search": {
            "complete": search.complete,
            "exhaustive": search.exhaustive,
            "confidence": search.confidence,
            "bases": search.bases,
            "hypotheses": search.hypotheses,
            "verified": search.verified,
            "seed": search.seed,
            "sampling": search.sampling,
            "complete_above": search.complete_above,
        },
        "warnings": warnings_json(result.warnings),
    }
    if "correspondences" in parts:
        answer["correspondences"] = [correspondence_json(pair, named) for pair in result.correspondences]
    if "alternatives" in parts:
        answer["alternatives"] = [alternative_json(other) for other in result.alternatives]
    if "missing_map" in parts:
        answer["missing_map"] = list(result.missing_map)
    if result.maps:
        answer["maps"] = [map_verdict_json(one) for one in result.maps]
    answer["frame_id"] = included.frame_id
    answer["child_frame_id"] = included.child_frame_id
    answer["stamp"] = included.stamp
    if "segments" in parts:
        answer["segments"] = included.segments
    return answer


def warnings_json(warnings: Iterable[AssociationWarning]) -> list[Json]:
    """Return what a caller should know."""
    return [{"code": warning.code, "message": warning.message} for warning in warnings]


def vectorization_json(found: Vectorization, moving: AssociationWarning | None = None) -> Json:
    """Return the answer of a vectorization; `moving` is the warning about a sensor whose motion is not known."""
    measured = found.measured
    unordered = None if found.ordered else AssociationWarning("points_not_in_order", NOT_IN_ORDER)
    return {
        "segments": measured.segments.endpoints.tolist(),
        "point_counts": measured.point_counts.astype(int).tolist(),
        "centroids": measured.centroids.tolist(),
        "spreads": measured.spreads.tolist(),
        "sigma": found.sigma,
        "sigmas": measured.sigma.tolist(),
        "rms": found.rms.tolist(),
        "warnings": warnings_json(one for one in (unordered, moving) if one is not None),
    }
