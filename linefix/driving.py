"""Search a scan; where a drive is not usable, search its last view alone.

A drive is a scan of several views whose steps are uncertain. Each view adds clutter, blocked lines of sight, and errors
of odometry beyond the stated ones. The last view may fix the pose nevertheless, and the drive remains evidence for it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import association
from association import (
    AnswerExplanation,
    AssociationOptions,
    AssociationResult,
    AssociationWarning,
    Deadline,
    InvalidSearchError,
    KnownOfMaps,
    MapIndex,
    MapSet,
    Scan,
    VerdictExplanation,
    Views,
)
from registration import Beams, MeasuredSegments, wrap_angle

Indices = NDArray[np.intp]
Search = Callable[[Scan], AssociationResult]

# The last view answers for a drive whose best pose is so near to its own, and so probable. Measured on 764 drives of
# 10 m in drawn buildings, with ranges and with segments: of 47 right answers that only the last view makes usable one
# is less probable, of 14 in other buildings five.
AGREED_DISTANCE = 0.3  # m
AGREED_ANGLE = math.radians(3.4)
AGREED_PROBABILITY = 0.5

LAST_VIEW_ONLY = AssociationWarning(
    "last_view_only",
    "The views of the drive together are not usable, the last view alone is, and both agree on the pose. The answer is "
    "that of the last view alone: check the covariance of the steps, and whether the map shows what the drive passed.",
)
OF_ANSWER = frozenset(
    ("prior_contradicted", "search_incomplete", "map_scale", "common_offset", "map_distorted", "turned")
)  # codes of warnings that are about a search and its pose, not about the scan


@dataclass(frozen=True, slots=True)
class Explanation:
    """An answer, and how its verdict came about.

    Attributes
    ----------
    result : AssociationResult
        As `locate` returns it.
    verdict : VerdictExplanation
        On the scan as a whole.
    last_view : VerdictExplanation or None
        On the last view of a drive alone, if it was searched.
    """

    result: AssociationResult
    verdict: VerdictExplanation
    last_view: VerdictExplanation | None


@dataclass(frozen=True, slots=True)
class LastView:
    """The last view of a drive, and the indices of its segments in the drive, (k,)."""

    scan: Scan
    own: Indices


def search(
    maps: MapIndex | MapSet,
    scan: Scan,
    known: KnownOfMaps,
    options: AssociationOptions | None = None,
    deadline: Deadline | None = None,
) -> AssociationResult:
    """Find a scan in a map, or on several: the search of each interface.

    The answer of a drive that is not usable is that of its last view, if `search_drive` finds that usable.

    Raises
    ------
    InvalidSearchError
        As of `association`, and when something about several maps is stated of a single one.
    """
    how = options or AssociationOptions()
    if isinstance(maps, MapIndex):
        for argument, stated in (("prior.map_id", known.prior_map), ("map_weights", known.map_weights)):
            if stated is not None:
                raise InvalidSearchError("found it with one map, expected it with several; omit it", argument=argument)

    def once(seen: Scan) -> AssociationResult:
        if isinstance(maps, MapSet):
            return association.associate_on_maps(maps, seen, known, how, deadline)
        return association.associate(maps, seen, known.prior, how, deadline)

    return search_drive(once, scan)


def explain_search(
    index: MapIndex, scan: Scan, known: KnownOfMaps, options: AssociationOptions, deadline: Deadline | None
) -> Explanation:
    """Search a scan on one map as `search`, and return how the verdict came about."""
    found: list[AnswerExplanation] = []

    def search(seen: Scan) -> AssociationResult:
        found.append(association.explain_verdict(index, seen, known.prior, options, deadline))
        return found[-1].result

    result = search_drive(search, scan)
    return Explanation(result, found[0].verdict, found[1].verdict if len(found) > 1 else None)


def search_drive(search: Search, scan: Scan) -> AssociationResult:
    """Search a scan; return the answer of the last view of a drive where the drive is not usable.

    The last view consists of all views whose pose in the scan's frame is exact. Its answer is returned if it is usable
    and the best pose of the drive agrees with it, is likely, and does not contradict the prior.

    Parameters
    ----------
    search : callable
        From a scan to its answer.
    scan : Scan
        Anything but a drive is searched once.

    Returns
    -------
    AssociationResult
        That of a last view has the indices of the drive's segments, and the warning `last_view_only`.
    """
    drive = search(scan)
    last = last_view(scan) if not drive.usable and _supports(drive) else None
    if last is None:
        return drive
    alone = search(last.scan)
    if alone.usable and _agree(alone, drive):
        return _of_drive(drive, alone, last.own, len(scan.measured))
    return drive if alone.search.complete else _cut_short(drive, alone)


def last_view(scan: Scan) -> LastView | None:
    """Return the views of a scan whose poses are exact.

    None where no view is, or all are: those are several sensors, or a drive of which no error is known.
    """
    views = scan.views
    if views is None:
        return None
    exact: NDArray[np.bool_] = ~np.any(views.root.reshape(len(views), -1), axis=1)
    segments, beams = exact[views.of_segment], exact[views.of_beam]
    own = np.flatnonzero(segments)
    if not 0 < len(own) < len(scan.measured):
        return None
    number = np.cumsum(exact) - 1
    some = Views(
        poses=tuple(pose for pose, one in zip(views.poses, exact, strict=True) if one),
        viewpoints=views.viewpoints[exact],
        of_segment=number[views.of_segment[segments]],
        of_beam=number[views.of_beam[beams]],
        root=np.zeros((3 * int(exact.sum()), 0)),
        found=np.zeros(0),
        spread=np.eye(0),
    )
    several, seen = len(some) > 1, _beams(scan.beams, beams)
    return LastView(
        replace(
            scan,
            measured=_measured(scan.measured, own),
            viewpoint=some.viewpoint,
            beams=seen if several or seen is None else replace(seen, origins=None),
            views=some if several else None,
        ),
        own,
    )


def _measured(measured: MeasuredSegments, own: Indices) -> MeasuredSegments:
    parts = {name: getattr(measured, name)[own] for name in ("sigma", "point_counts", "centroids", "spreads")}
    return replace(measured, segments=measured.segments.take(own), **parts)


def _beams(beams: Beams | None, own: NDArray[np.bool_]) -> Beams | None:
    if beams is None or beams.origins is None:
        return None
    return replace(beams, **{name: getattr(beams, name)[own] for name in ("angles", "ranges", "origins")})


def _supports(drive: AssociationResult) -> bool:
    """Return whether a drive that is not usable makes its pose likely, within the prior."""
    contradicted = any(reason.code == "prior_contradicted" for reason in drive.reasons)
    return not contradicted and (drive.probability or 0.0) >= AGREED_PROBABILITY


def _agree(one: AssociationResult, other: AssociationResult) -> bool:
    if one.pose is None or other.pose is None or one.map_id != other.map_id:
        return False
    away = math.hypot(one.pose.x - other.pose.x, one.pose.y - other.pose.y)
    return away <= AGREED_DISTANCE and abs(wrap_angle(one.pose.theta - other.pose.theta)) <= AGREED_ANGLE


def _of_drive(drive: AssociationResult, alone: AssociationResult, own: Indices, count: int) -> AssociationResult:
    """Return the answer of a last view with the indices of the drive's `count` segments; those of others are unmatched.

    Warnings about the scan of the drive are included: they may be why the drive is not usable.
    """
    unmatched = np.ones(count, dtype=bool)
    unmatched[own] = False
    unmatched[own[list(alone.unmatched_scan)]] = True
    diagnostics = alone.diagnostics
    if diagnostics is not None and diagnostics.critical_wall is not None:
        wall = diagnostics.critical_wall
        wall = replace(wall, scan=tuple(own[list(wall.scan)].tolist()))
        diagnostics = replace(diagnostics, critical_wall=wall)
    warnings = {one.code: one for one in alone.warnings}
    warnings |= {one.code: one for one in drive.warnings if one.code not in OF_ANSWER}
    return replace(
        alone,
        correspondences=tuple(replace(pair, scan=int(own[pair.scan])) for pair in alone.correspondences),
        unmatched_scan=tuple(np.flatnonzero(unmatched).tolist()),
        diagnostics=diagnostics,
        warnings=(*warnings.values(), LAST_VIEW_ONLY),
    )


def _cut_short(drive: AssociationResult, alone: AssociationResult) -> AssociationResult:
    """Return the answer of a drive whose last view was not searched to the end, and which is incomplete for it."""
    if not drive.search.complete:
        return drive
    return replace(
        drive,
        search=drive.search.cut_short(),
        reasons=(*(one for one in alone.reasons if one.code == "search_incomplete"), *drive.reasons),
        warnings=(*drive.warnings, *(one for one in alone.warnings if one.code == "search_incomplete")),
    )
