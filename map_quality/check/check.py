"""Checking a map without scans: as it is drawn, and by simulated scans that are searched in the map itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from association import CancelledError, Deadline, IndexingEndedError, MapIndex

from ..analyze.analyze import Analysis
from ..views import Robot, finished, in_time, look
from . import tuning
from .pieces import drawing_findings, drawn_sigma, find_near_walls
from .result import Advice, Finding, MapCheck, Place, Size
from .sides import Sides, direction_findings, look_from_walls

ROBOT = Robot(beams=tuning.RAYS, range_max=tuning.REACH, sigma=tuning.SIGMA)


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
    is_likely, lengths = tuning.SMALLEST <= size.diagonal <= tuning.LARGEST, np.sort(index.walls.longest)
    usual = float(lengths[np.searchsorted(np.cumsum(lengths), 0.5 * size.length)])
    if not is_likely or usual > tuning.LONGEST_USUAL:
        message = (
            f"The map's diagonal is {size.diagonal:.3g} m, expected {tuning.SMALLEST:g} to {tuning.LARGEST:g} m, and "
            f"half of the length of its walls is in walls of {usual:.3g} m and more, expected at most "
            f"{tuning.LONGEST_USUAL:g} m. Check that it is in metres."
        )
        findings.append(Finding("unlikely_size", message))
    advice, near = Advice(drawn_sigma(index)), find_near_walls(index, until)
    if oriented and is_likely:  # in another unit walls are too far apart to see one another
        sides = look_from_walls(index, near.opposite, until)
        findings += direction_findings(index, sides)
        advice = Advice(advice.sigma, _directed(sides, findings))
    if not until.passed:
        findings += drawing_findings(index, near, until)
    means_something = oriented and advice.oriented is not False
    likeness = find_look_alikes(index, until, oriented=means_something) if is_likely else Likeness()
    findings += likeness.findings
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
    findings : tuple of Finding
        At most one, with the segments that are seen from these.
    """

    viewpoints: int = 0
    places: tuple[Place, ...] = ()
    findings: tuple[Finding, ...] = ()


def find_look_alikes(index: MapIndex, deadline: Deadline, *, oriented: bool) -> Likeness:
    """Analyze a map at a few places: which of them are similar to others.

    The number of places depends on the time that the deadline leaves.
    """
    try:
        analysis = Analysis.over(index if oriented else index.undirected_by(deadline), ROBOT)
    except IndexingEndedError:
        return Likeness()
    looked, places, hits = 0, [], set[int]()
    for number in in_time(analysis.standing.order.tolist(), deadline):
        found = finished(analysis.looking(number, deadline))
        looked += found is not None
        if found is not None and found.similar_pose is not None:
            places.append(Place(found.pose, found.similar_pose))
            hits.update(look(analysis.segments, found.pose, ROBOT, np.random.default_rng(number)).hits.tolist())
        if looked == tuning.PLACES:
            break
    if not places:
        return Likeness(looked)
    message = (
        f"At {len(places)} of {looked} poses a laser with a range of {tuning.REACH:g} m sees the same as at another "
        "pose of the map. There a scan alone is ambiguous: send a prior, or the scans of a drive."
    )
    return Likeness(looked, tuple(places), (Finding("looks_alike", message, tuple(sorted(hits))),))
