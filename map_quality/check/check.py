"""Checking a map without scans: as it is drawn, and by simulated scans that are searched in the map itself."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from association import AssociationOptions, CancelledError, Deadline, IndexingEndedError, MapIndex, associate
from registration import RigidTransform, Segments
from simulation import Scanner, scan

from ..views import Robot, in_time, look, similar_pose
from . import tuning
from .pieces import drawing_findings, drawn_sigma, find_near_walls, longest_pieces
from .result import Advice, Finding, MapCheck, Place, Size
from .sides import Sides, direction_findings, look_from_walls

LEAST_SEEN = 3  # segments of a scan that is searched
ROBOT = Robot(beams=tuning.RAYS, range_max=tuning.REACH, sigma=tuning.SIGMA)
RAY = Scanner(beams=1, angle_min=0.0, range_max=tuning.FOLLOWED, sigma=0.0)


def check_map(index: MapIndex, deadline: Deadline | None = None, *, oriented: bool = True) -> MapCheck:
    """Look for doubtful parts of a map: its directions, how it was drawn, its size, places that look alike.

    Parameters
    ----------
    index : MapIndex
        Built with its directions, whatever they mean.
    deadline : Deadline, optional
        When it passes, the findings so far are the answer and ``complete`` is False.
    oriented : bool
        True when the map states that directions mean something.

    Returns
    -------
    MapCheck

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    until = deadline or Deadline()
    size = Size(index.directed, len(index.walls.rows), float(index.walls.longest.sum()), index.diagonal)
    findings: list[Finding] = []
    if not tuning.SMALLEST <= size.diagonal <= tuning.LARGEST:
        said = f"{size.diagonal:.3g} m, expected {tuning.SMALLEST:g} to {tuning.LARGEST:g} m"
        findings.append(Finding("unlikely_size", f"The map's diagonal is {said}. Check that it is in metres."))
    advice, near = Advice(drawn_sigma(index)), find_near_walls(index, until)
    if oriented and not findings:  # of another unit walls are too far apart to see one another
        sides = look_from_walls(index, near.opposite, until)
        findings += direction_findings(index, sides)
        advice = Advice(advice.sigma, _directed(sides, findings))
    for found in () if until.passed else drawing_findings(index, near, until):
        findings.append(found)
        if until.passed:
            break
    means_something = oriented and advice.oriented is not False
    likeness = find_look_alikes(index, until, oriented=means_something)
    findings += likeness_findings(likeness)
    if until.cancelled:
        raise CancelledError
    return MapCheck(size, tuple(findings), advice, likeness.places, likeness.viewpoints, not until.passed)


def _directed(sides: Sides, findings: list[Finding]) -> bool | None:
    """Return whether directions mean something; None where findings, or no rays that hit, leave that open."""
    if sides.meaningless:
        return False
    return None if findings or not sides.hits[:, 0].sum() else True


@dataclass(frozen=True, slots=True)
class Likeness:
    """Similar places of a map.

    Attributes
    ----------
    viewpoints : int
        Number of places that were tried.
    places : tuple of Place
        Those that are similar to others.
    segments : tuple of int
        The segments that are seen from these.
    """

    viewpoints: int
    places: tuple[Place, ...]
    segments: tuple[int, ...]


def find_look_alikes(index: MapIndex, deadline: Deadline, *, oriented: bool) -> Likeness:
    """Simulate scans at some places, spread over the length of the walls, and search each in the map.

    The number of places depends on the time that the deadline leaves.
    """
    try:
        searched = index if oriented else index.undirected_by(deadline)
    except IndexingEndedError:
        return Likeness(0, (), ())
    segments = index.segments.take(np.arange(index.directed))
    options = AssociationOptions(oriented=oriented, on_map=1.0)
    looked, found, hits = 0, [], set[int]()
    for number, pose in in_time(enumerate(_places(index, segments)), deadline):
        seen = look(segments, pose, ROBOT, np.random.default_rng(number))
        if len(seen.scan.measured) < LEAST_SEEN:
            continue
        other = similar_pose(associate(searched, seen.scan, None, options, deadline), pose)
        looked += 1
        if other is not None:
            found.append(Place(pose, other))
            hits.update(seen.hits.tolist())
    return Likeness(looked, tuple(found), tuple(sorted(hits)))


def likeness_findings(likeness: Likeness) -> Iterator[Finding]:
    """Describe how much of the map is similar to another part of it."""
    if likeness.places:
        yield Finding(
            "looks_alike",
            f"At {len(likeness.places)} of {likeness.viewpoints} poses a laser with a range of {tuning.REACH:g} m sees "
            "the same as at another pose of the map. There a scan alone is ambiguous: send a prior, or the scans of a "
            "drive.",
            likeness.segments,
        )


def _places(index: MapIndex, segments: Segments) -> Iterator[RigidTransform]:
    """Yield free places in front of walls, in the map frame, at even steps of the length of all walls."""
    reached = np.cumsum(index.walls.longest)
    chosen = np.searchsorted(reached, (np.arange(tuning.PLACES) + 0.5) / tuning.PLACES * reached[-1])
    for piece in dict.fromkeys(longest_pieces(index)[chosen].tolist()):
        place = _free_place(segments, piece % index.directed)
        if place is not None:
            yield place


def _free_place(segments: Segments, piece: int) -> RigidTransform | None:
    """Return a place in front of the middle of a segment, on its free side where a scan shows something from there."""
    (x, y), (dx, dy) = segments.midpoints[piece], segments.directions[piece]
    for normal in (math.atan2(dx, -dy), math.atan2(-dx, dy)):
        c, s = math.cos(normal), math.sin(normal)
        at_wall = RigidTransform(x + tuning.OFF_THE_WALL * c, y + tuning.OFF_THE_WALL * s, normal)
        room = float(scan(segments, at_wall, RAY).ranges[0])
        if tuning.LEAST_ROOM < room < math.inf:
            away = min(tuning.CLEARANCE, 0.5 * room)
            return RigidTransform(x + away * c, y + away * s, 0.0)
    return None
