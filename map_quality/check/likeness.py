"""What of a map looks alike: scans that it would give, searched in the map itself."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from association.associating import associate
from association.deadline import Deadline
from association.errors import IndexingEndedError
from association.index.map_index import MapIndex
from association.options import AssociationOptions
from association.result import AssociationResult
from association.scan.scan import Scan
from registration import MeasuredSegments, RigidTransform, Segments, wrap_angle

from .looking import Looker, segments_of
from .result import Finding, Place
from .tuning import CLEARANCE, FOLLOWED, PLACES, RAYS, REACH, SHORTEST_SEEN, SIGMA

SAME_PLACE = 0.5  # m, and rad; nearer than that a pose is the one that was looked from


@dataclass(frozen=True, slots=True)
class View:
    """What a laser would see of a map.

    Attributes
    ----------
    pose : RigidTransform
        Of the laser in the index frame.
    segments : (k, 4) in the laser's frame, metres
    walls : (k,) of which each is a part
    """

    pose: RigidTransform
    segments: np.ndarray[tuple[int, int], np.dtype[np.float64]]
    walls: np.ndarray[tuple[int], np.dtype[np.intp]]


@dataclass(frozen=True, slots=True)
class Likeness:
    """From how many places it was looked, and which of them look like others; `walls` are what is seen from those."""

    viewpoints: int
    places: tuple[Place, ...]
    walls: tuple[int, ...]


def find_look_alikes(index: MapIndex, deadline: Deadline, *, oriented: bool) -> Likeness:
    """Look about from some places, spread over the length of the walls, and search each view in the map.

    From no more places than the deadline leaves time for.
    """
    try:
        place = index if oriented else index.undirected_by(deadline)
    except IndexingEndedError:
        return Likeness(0, (), ())
    options = AssociationOptions(oriented=oriented)
    looked, found, walls = 0, [], set[int]()
    for view in _views(index, deadline):
        measured = MeasuredSegments.from_segments(Segments.from_array(view.segments), SIGMA)
        result = associate(place, Scan(measured), None, options, deadline)
        looked += 1
        other = _look_alike(result, _in_map(index, view.pose))
        if other is not None:
            found.append(Place(_in_map(index, view.pose), other))
            walls |= set(view.walls.tolist())
    return Likeness(looked, tuple(found), tuple(sorted(walls)))


def likeness_findings(index: MapIndex, likeness: Likeness) -> Iterator[Finding]:
    """Describe how much of the map is similar to another part of it."""
    if likeness.places:
        yield Finding(
            "looks_alike",
            f"At {len(likeness.places)} of {likeness.viewpoints} poses a laser with a range of {REACH:g} m sees the "
            "same as at another pose of the map. There a scan alone is ambiguous: send a prior, or the scans of a "
            "drive.",
            segments_of(index, np.array(likeness.walls, dtype=np.intp)),
        )


def _views(index: MapIndex, deadline: Deadline) -> Iterator[View]:
    """Yield what is seen from free places before walls at even steps of their length."""
    looker, lengths = Looker(index), index.walls.longest
    reached = np.cumsum(lengths)
    chosen = np.searchsorted(reached, (np.arange(PLACES) + 0.5) / PLACES * reached[-1])
    for wall in dict.fromkeys(chosen.tolist()):
        if deadline.passed:
            return
        pose = _free_place(looker, wall)
        view = None if pose is None else look_about(looker, pose, deadline)
        if view is not None and len(view.segments) >= 3:
            yield view


def _free_place(looker: Looker, wall: int) -> RigidTransform | None:
    """Return a place before the middle of a wall, on its free side where something is seen from there."""
    row = looker.index.walls.rows[wall]
    along, normal = 0.5 * float(row["begin"] + row["end"]), float(row["angle"]) + 0.5 * math.pi
    x = float(row["dx"]) * along - float(row["dy"]) * float(row["offset"])
    y = float(row["dy"]) * along + float(row["dx"]) * float(row["offset"])
    for angle in (normal, normal + math.pi):
        c, s = math.cos(angle), math.sin(angle)
        reach, met = looker.first(x + 1e-3 * c, y + 1e-3 * s, angle, FOLLOWED)
        if met >= 0 and reach > 0.6:
            away = min(CLEARANCE, 0.5 * reach)
            return RigidTransform(x + away * c, y + away * s, 0.0)
    return None


def look_about(looker: Looker, pose: RigidTransform, deadline: Deadline | None = None) -> View | None:
    """Return what is seen from a pose: of each wall the stretches that neighbouring rays meet; None at the deadline."""
    angles = [math.tau * k / RAYS for k in range(RAYS)]
    hits = []
    for angle in angles:
        if deadline is not None and deadline.passed:
            return None
        hits.append(looker.first(pose.x, pose.y, angle + pose.theta, REACH))
    begin = next((k for k in range(RAYS) if hits[k][1] != hits[k - 1][1]), 0)
    segments, walls, first = [], [], begin
    for step in range(1, RAYS + 1):
        k, before = (begin + step) % RAYS, (begin + step - 1) % RAYS
        if step < RAYS and hits[k][1] == hits[before][1]:
            continue
        wall, ends = hits[before][1], [hits[one][0] for one in (first, before)]
        x1, y1, x2, y2 = (
            reach * turned(angles[one])
            for reach, one in zip(ends, (first, before), strict=True)
            for turned in (math.cos, math.sin)
        )
        if wall >= 0 and math.hypot(x2 - x1, y2 - y1) >= SHORTEST_SEEN:
            segments.append((x1, y1, x2, y2))
            walls.append(wall)
        first = k
    return View(pose, np.array(segments, dtype=np.float64).reshape(-1, 4), np.array(walls, dtype=np.intp))


def _look_alike(result: AssociationResult, truth: RigidTransform) -> RigidTransform | None:
    """Return another pose that explains a view as well, if there is one."""
    if not any(reason.code == "similar_place" for reason in result.reasons):
        return None
    poses = [result.pose, *(other.pose for other in result.alternatives)]
    return next((pose for pose in poses if pose is not None and not _is_near(pose, truth)), None)


def _is_near(pose: RigidTransform, other: RigidTransform) -> bool:
    away = math.hypot(pose.x - other.x, pose.y - other.y)
    return away < SAME_PLACE and abs(wrap_angle(pose.theta - other.theta)) < SAME_PLACE


def _in_map(index: MapIndex, pose: RigidTransform) -> RigidTransform:
    return RigidTransform(pose.x + float(index.origin[0]), pose.y + float(index.origin[1]), pose.theta)
