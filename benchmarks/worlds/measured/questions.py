"""Drawn cases as a caller would send them: each scan with its raw ranges, and as bare segments."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from association import HardPrior, MapIndex, Scan
from registration import MeasuredSegments
from simulation import Scanner
from vectorization import LaserScan, VectorizationOptions, vectorize

from ..buildings import FAMILIES
from ..cases import Case, draw_case
from ..conditions import CONDITIONS

FORMS = ("ranges", "segments")
HALVES = {"fitting": False, "reporting": True}  # of the worlds: whether nothing may be fitted on them


@dataclass(frozen=True, slots=True)
class Question:
    """A scan and the map to search it in.

    Attributes
    ----------
    case : Case
        A drawn case, with the truth.
    index : MapIndex
        Of the map, in whose frame the truth is.
    scans : dict
        By form. "ranges": the vectorized scan with its beams. "segments": its segments and the declared noise alone, as
        of a caller without further knowledge.
    prior : HardPrior or None
    """

    case: Case
    index: MapIndex
    scans: dict[str, Scan]
    prior: HardPrior | None


def questions(worlds: Iterable[str], conditions: Iterable[str], numbers: Iterable[int]) -> Iterator[Question]:
    """Draw a question for each world, condition and number; the same three draw the same.

    Parameters
    ----------
    worlds : iterable of str
        Names in `FAMILIES`.
    conditions : iterable of str
        Names in `CONDITIONS`.
    numbers : iterable of int
        From 0 up.
    """
    conditions, numbers = list(conditions), list(numbers)
    for world in worlds:
        for condition in conditions:
            for number in numbers:
                yield question(draw_case(world, condition, number))


def question(case: Case) -> Question:
    """Return a case as it would be sent."""
    scanner = case.scanner
    found = vectorize(laser(scanner, case.ranges), VectorizationOptions(sigma=scanner.sigma))
    bare = MeasuredSegments.from_segments(found.measured.segments, scanner.sigma)
    prior = None
    if case.window is not None:
        prior = HardPrior(case.window.pose, case.window.radius, min(case.window.angle, math.pi))
    scans = {"ranges": Scan(found.measured, (0.0, 0.0), found.beams), "segments": Scan(bare)}
    return Question(case, MapIndex.build(case.map), scans, prior)


def laser(scanner: Scanner, ranges: np.ndarray) -> LaserScan:
    """Return what a scanner reports."""
    return LaserScan(scanner.angle_min, scanner.angle_increment, ranges, scanner.range_min, scanner.range_max)


def in_map(condition: str) -> bool:
    """Tell whether a condition leaves the truth in the map."""
    return CONDITIONS[condition].stranger is None


def kept_for_report(world: str) -> bool:
    """Tell whether nothing may be fitted on a world."""
    return FAMILIES[world].held_out
