"""The result of `associate`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from registration import Ambiguity, RegistrationDiagnostics, RigidTransform, wrap_angle

Floats = NDArray[np.float64]
AS_WELL = 5.0  # nats below the best score, within which another pose explains a scan about as well
MOST = 99.99  # %; nothing is certain
OTHER_WAY_ROUND = 0.5 * math.pi  # rad
ReasonCode = Literal[
    "prior_contradicted",
    "search_incomplete",
    "not_on_map",
    "unobservable_direction",
    "similar_place",
    "single_wall",
    "map_mismatch",
    "insufficient_evidence",
]
WarningCode = Literal[
    "no_segments",
    "points_not_in_order",
    "motion_unknown",
    "nulls_for_no_return",
    "stuck_ranges",
    "scan_exceeds_map",
    "unlikely_map_size",
    "faces_away",
    "prior_contradicted",
    "search_incomplete",
    "map_scale",
    "common_offset",
    "map_distorted",
    "turned",
    "last_view_only",
]


class Status(StrEnum):
    """The verdict, in order of precedence."""

    NO_MATCH = "no_match"
    DEGENERATE = "degenerate"
    AMBIGUOUS = "ambiguous"
    OK = "ok"


@dataclass(frozen=True, slots=True)
class Correspondence:
    """A scan segment found on a map segment.

    Attributes
    ----------
    scan, map : int
        Indices as sent.
    overlap : float
        Fraction of the scan segment's length that lies on the map, 0 to 1.
    offset : float
        Metres, signed: ``n_map . (R m_scan + t) - p_map`` at the midpoint of the scan segment.
    angle : float
        Radians: ``wrap(angle(d_map) - angle(d_scan) - theta)``.
    weight : float
        1 / m^2, the information of the pair.
    alternatives : tuple of int
        Other map indices that pass the gates.
    """

    scan: int
    map: int
    overlap: float
    offset: float
    angle: float
    weight: float
    alternatives: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class CriticalWall:
    """The wall whose removal would move the pose most, or leave it unobservable.

    Attributes
    ----------
    scan, map : tuple of int
        Indices of the segments seen on it and of the map segments that they lie on, as sent.
    direction : (float, float)
        Unit vector in the map frame along which the pose would move, or be free.
    displacement : float
        Metres; by how much, or the standard deviation along that direction where that is more.
    """

    scan: tuple[int, ...]
    map: tuple[int, ...]
    direction: tuple[float, float]
    displacement: float


@dataclass(frozen=True, slots=True)
class Reason:
    """Why an answer is not usable: a stable code and a message."""

    code: ReasonCode
    message: str


@dataclass(frozen=True, slots=True)
class Corrections:
    """Errors of the map around the sensor, or of the ranges, that a pose was estimated together with.

    Attributes
    ----------
    scale : float
        Factor on the lengths of the scan, 1 where there is none.
    offset : float
        Metres by which all walls are nearer to the sensor than the map has them: a bias of ranges, or thick walls.
    strain : tuple of 3 floats
        Elongation of the map along its x and y axis, and half of the shear, as fractions: xx, yy, xy.
    """

    scale: float = 1.0
    offset: float = 0.0
    strain: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class AssociationDiagnostics(RegistrationDiagnostics):
    """Numbers next to the pose; those of `RegistrationDiagnostics` are of the accepted pairs at the answered pose.

    Attributes
    ----------
    inlier_fraction : float
        Fraction of the scan's length that is matched.
    score : float
        Log-likelihood over that of a scan that is all clutter, nats, by the sums at the estimator's pose. The verdict
        and the order use that of the joint estimator, from which `runner_up` and `margin` come.
    runner_up : float or None
        Score of the best other pose over that of the best, never below 0; None where no other pose was found, that is
        none above `SearchReport.complete_above` of the score.
    margin : float or None
        Score of the best less that of the best other pose, nats; None likewise.
    critical_wall : CriticalWall or None
        None where the pose stays within `CRITICAL_DISPLACEMENT` metres without any one wall.
    corrections : Corrections or None
        None where the pose was estimated alone. Else `registration.register` with the accepted pairs gives the pose
        without them.
    turn_rate : float or None
        Rate at which the sensor turned during the scan, as the walls show it, rad/s; None where it was sent (`twist`),
        or shows no rotation.
    """

    inlier_fraction: float
    score: float
    runner_up: float | None
    margin: float | None
    critical_wall: CriticalWall | None
    corrections: Corrections | None = None
    turn_rate: float | None = None


@dataclass(frozen=True, slots=True)
class Alternative:
    """Another pose that explains part of the scan; ambiguity and reliability as of the best, with the same sigmas.

    Attributes
    ----------
    probability : float or None
        That this pose is right, 0 to 1: all of them and the answer's together make at most 1. None where the answer has
        none, or contradicts the prior.
    map_id : str or None
        Of several maps the one that the pose is on; None where a single map was searched.
    """

    pose: RigidTransform
    covariance: Floats | None
    score: float
    ambiguity: Ambiguity
    reliability: float
    inlier_fraction: float
    probability: float | None
    map_id: str | None = None


@dataclass(frozen=True, slots=True)
class SearchReport:
    """Report of the search.

    Attributes
    ----------
    complete : bool
        False if the deadline ended it before the confidence was reached or the bases were used up. Also False if the
        deadline ended it before all found poses were compared.
    exhaustive : bool
        True if every base was searched, and the search is complete.
    confidence : float
        Reached probability of not having missed a better consensus set among the bases; below the requested one where a
        scan of many segments has few that together fix a pose well.
    bases, hypotheses, verified : int
        Bases drawn, poses they gave, poses that were scored to the end.
    seed : int
    sampling : "ordered" or "random"
    complete_above : float
        Fraction of the best score, by segments, above which no other pose was missed, with that confidence; 1 where the
        search is not complete. Of poses whose matches agree with one another within their tolerances: one at which they
        do not, and which is a compromise between them, may be missed.
    """

    complete: bool
    exhaustive: bool
    confidence: float
    bases: int
    hypotheses: int
    verified: int
    seed: int
    sampling: str
    complete_above: float

    def cut_short(self) -> SearchReport:
        """Return the report of the same search where something was left undone: nothing is claimed of the rest."""
        return replace(self, complete=False, exhaustive=False, complete_above=1.0)


@dataclass(frozen=True, slots=True)
class AssociationWarning:
    """A warning to the caller: a stable code and a message."""

    code: WarningCode
    message: str


@dataclass(frozen=True, slots=True)
class MapVerdict:
    """The best pose on one of several maps.

    Attributes
    ----------
    map_id : str
    status : Status
        Of the map of the answer that of the answer. Of another one `ambiguous` where its pose explains the scan about
        as well, and the answer is not usable, else `no_match`.
    score : float or None
        Log-likelihood over that of a scan that is all clutter, and the logarithm of the map's weight over the largest
        weight, nats; None where no pose was found on the map.
    probability : float or None
        Probability that this pose is right, 0 to 1; None where the answer has none.
    pose : RigidTransform or None
        In the map's own frame; None where none was found.
    """

    map_id: str
    status: Status
    score: float | None
    probability: float | None
    pose: RigidTransform | None


@dataclass(frozen=True, slots=True)
class AssociationResult:
    """The answer of `associate`; lengths in metres, angles in radians, poses map_from_scan.

    Attributes
    ----------
    status : Status
    usable : bool
        The one flag to gate on.
    probability : float or None
        Calibrated probability that the pose is right, 0 to 1; 0 for `no_match`, None for `degenerate`: the position is
        open along `unobservable`, and the pose is one of a family.
    pose : RigidTransform or None
        None for `no_match`.
    covariance : (3, 3) or None
        Of additive (x, y, theta) in the map frame; None for `no_match` and `degenerate`.
    unobservable : (float, float) or None
        Unit vector in the map frame along which the position is not fixed.
    correspondences : tuple of Correspondence
        By scan index.
    unmatched_scan : tuple of int
    missing_map : tuple of int
        Map segments that rays to matched segments pass through.
    diagnostics : AssociationDiagnostics or None
        None when nothing was matched.
    reasons : tuple of Reason
        Why it is not usable, the weightiest first; empty when it is.
    alternatives : tuple of Alternative
        Distinct from the pose and from each other, best first.
    search : SearchReport
    warnings : tuple of AssociationWarning
    map_id : str or None
        Of several maps the one that the pose is on; None for `no_match`, and where a single map was searched.
    maps : tuple of MapVerdict
        Of several maps each, the best first; empty where a single map was searched.
    frame_id, child_frame_id : str or None
        Names of the frame of the map, of several the one of the pose or the first, and of that of the scan. None where
        the map, or the scan, has none.
    stamp : any
        Of the scan, as it was given; None where it has none.
    """

    status: Status
    usable: bool
    probability: float | None
    unmatched_scan: tuple[int, ...]
    reasons: tuple[Reason, ...]
    alternatives: tuple[Alternative, ...]
    search: SearchReport
    warnings: tuple[AssociationWarning, ...]
    pose: RigidTransform | None = None
    covariance: Floats | None = None
    unobservable: tuple[float, float] | None = None
    correspondences: tuple[Correspondence, ...] = ()
    missing_map: tuple[int, ...] = ()
    diagnostics: AssociationDiagnostics | None = None
    map_id: str | None = None
    maps: tuple[MapVerdict, ...] = ()
    frame_id: str | None = None
    child_frame_id: str | None = None
    stamp: Any = None

    @property
    def message(self) -> str:
        """The verdict in one or two sentences, for people."""
        if self.status is Status.NO_MATCH or self.pose is None or self.diagnostics is None:
            larger = any(one.code == "scan_exceeds_map" for one in self.warnings)
            unit = " It is larger than the map: its unit may be wrong, see `warnings`." if larger else ""
            return f"No pose on {'these maps' if self.maps else 'this map'} explains the scan.{unit}"
        least = self.diagnostics.score - AS_WELL
        others = [other for other in self.alternatives if other.score >= least]
        if self.status is Status.DEGENERATE:
            theta = self.pose.theta
            turned = any(abs(wrap_angle(one.pose.theta - theta)) > OTHER_WAY_ROUND for one in others)
            which = ", and the heading may be reversed" if turned else ""
            if self.unobservable is None:
                return f"The observed walls do not fix the robot's position{which}."
            dx, dy = (round(part, 2) + 0.0 for part in self.unobservable)  # no negative zeros
            return f"The position along the direction ({dx:.2f}, {dy:.2f}) is unknown{which}."
        chance = f"{min(100.0 * (self.probability or 0.0), MOST):.2f} %"
        if self.usable:
            on_map = f" on the map {self.map_id}" if self.maps else ""
            return f"The robot is at this pose{on_map} with a probability of {chance}."
        if any(reason.code == "similar_place" for reason in self.reasons) and others:
            many = "1 other pose fits" if len(others) == 1 else f"{len(others)} other poses fit"
            return f"{many} the scan about as well{self._where(others)}. The scan alone does not decide between them."
        return f"The most likely pose has a probability of {chance}, which is not enough: see `reasons`."

    def _where(self, others: Sequence[Alternative]) -> str:
        """Name the other map of other poses, or the number of maps; nothing if all are on that of the answer."""
        maps = sorted({other.map_id for other in others if other.map_id is not None} - {self.map_id})
        if not maps:
            return ""
        return f", on the map {maps[0]}" if len(maps) == 1 else f", on {len(maps)} other maps"
