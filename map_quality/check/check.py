"""Checking a map without scans."""

from __future__ import annotations

from association import CancelledError, Deadline, MapIndex

from . import tuning
from .likeness import find_look_alikes, likeness_findings
from .pieces import drawing_findings, drawn_sigma, find_near_walls
from .result import Advice, Finding, MapCheck, Size
from .sides import Sides, direction_findings, look_from_walls


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
