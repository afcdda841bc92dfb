"""The table of beams: what the map shows each beam at each pose, and what follows from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from registration.layout import Floats, Records, floats

from ..context import SearchContext
from ..layout import SHOWN
from ..scan.beams import BeamSet
from ..tuning import MOST_LOOKED_AT
from .kernels.rays import cast_beams, passed_walls
from .tuning import (
    BEAMS_PASSED,
    BEAMS_READ,
    BLOCKED,
    BLOCKING_LENGTH,
    BLOCKING_RAYS,
    CERTAIN,
    LEAST_INCIDENCE,
    NEAR,
    SURE_LENGTH,
    WALL_BEHIND,
)


@dataclass(frozen=True, slots=True)
class BeamEvidence:
    """The evidence of the beams at poses, (k, m) each.

    Attributes
    ----------
    across : float64
        By how much a beam reads farther than the map shows, metres across the wall; nan where the map shows no wall, or
        the beam nothing.
    read, passed : float64
        Degree to which a beam reads the wall that it should, and to which it passed through it, 0 to 1.
    """

    across: Floats
    read: Floats
    passed: Floats


def cast(context: SearchContext, beams: BeamSet, poses: Records) -> Records:
    """Return what the map shows each beam at each pose, (k, m) of `SHOWN`; nothing where rays cannot be followed.

    Beams end at points of the map as at walls. One that passes a point is compared with the walls alone, so that points
    never speak against a pose.
    """
    table, index = np.zeros((len(poses), len(beams)), SHOWN), context.index
    table["wall"] = -1
    if not context.can_look or not len(beams):
        return table
    step = max(1, int(MOST_LOOKED_AT / (1.0 + len(beams) * index.across * index.most_near)))
    for begin in range(0, len(poses), step):
        if begin and context.deadline.passed:
            break
        some = slice(begin, begin + step)
        cast_beams(beams.rows, beams.reach, WALL_BEHIND, poses[some], index.obstacles, table[some])
        if len(index.points):
            walls = np.zeros_like(table[some])
            cast_beams(beams.rows, beams.reach, WALL_BEHIND, poses[some], index.tables.place, walls)
            passed = table["wall"][some] >= len(index.walls.rows)
            passed &= beams.rows["range"] - table["distance"][some] > CERTAIN
            table[some][passed] = walls[passed]
    return table


def evidence_of(context: SearchContext, beams: BeamSet, table: Records, wider: float = 1.0) -> BeamEvidence:
    """Return what beams say at poses, all of (k, m), by a table of what the map shows; gates `wider` times as wide."""
    (ranges,), (begins, ends) = floats(beams.rows, "range"), floats(context.index.obstacles.walls, "begin", "end")
    lengths = ends - begins
    known = (table["wall"] >= 0) & np.isfinite(ranges)
    with np.errstate(invalid="ignore"):
        off = (ranges - table["distance"]) * np.maximum(LEAST_INCIDENCE, table["incidence"])
        across = np.where(known, off, np.nan)
        read = np.where(known, np.exp(-0.5 * (across / (NEAR * wider)) ** 2), 0.0)
        passed = np.where(across > CERTAIN * wider, np.minimum(1.0, lengths[table["wall"]] / SURE_LENGTH), 0.0)
    return BeamEvidence(across, read, passed)


def score_of_beams(beams: BeamSet, evidence: BeamEvidence) -> Floats:
    """Return the term of a laser's beams in the score of each pose, (k,) nats."""
    total = max(1e-9, float(beams.weights.sum()))
    return np.asarray((BEAMS_READ * evidence.read - BEAMS_PASSED * evidence.passed) @ beams.weights / total)


def penalty_of_sight(context: SearchContext, beams: BeamSet, table: Records, matches: Records) -> Floats:
    """Return the penalty of lines of sight at each pose, (k,) nats: for walls that should have blocked the view."""
    poses, walls, to_matched, to_clutter = passed_walls(beams.rows, beams.line, beams.sensor, table, matches)
    begins, ends = floats(context.index.obstacles.walls[walls], "begin", "end")
    lengths = np.minimum(BLOCKING_LENGTH, ends - begins)
    rays = np.minimum(1.0, to_matched / BLOCKING_RAYS) + np.minimum(1.0, to_clutter / BLOCKING_RAYS)
    return np.bincount(poses, BLOCKED * lengths * rays, len(table)).astype(np.float64)
