"""The result of a question, as one flat record."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from association import AssociationResult, Status, associate
from registration import RigidTransform, Segments, wrap_angle
from simulation import Scanner, scan

from ...outcomes import offset
from ..cases import Case
from ..map_errors import wall_of_segment
from .questions import Question, in_map, kept_for_report

DISTANCE, ANGLE = 0.3, 3.0  # m and degrees; an answer that is off by less is right
FINE_DISTANCE, FINE_ANGLE = 0.1, 1.0

TOLERANCE = 0.03  # m; a beam reads what the map shows within this and
SIGMAS = 4.0  # times the noise

DIAGNOSTICS = ("inlier_fraction", "score", "runner_up", "margin")
OF_THE_REGISTRATION = ("chi2", "dof", "reliability")


@dataclass(frozen=True, slots=True)
class WorldOutcome:
    """An answer next to the truth; lengths in metres.

    Attributes
    ----------
    world, condition, number : str, str, int
        The parameters of the case.
    held_out : bool
        True if nothing may be fitted on this world.
    form : str
        "ranges" or "segments".
    truth, pose : [x, y, theta] or None
        No truth for an out-of-map scan, no pose for `no_match`.
    status : str
    usable : bool
    reasons : list of str
        Their codes.
    probability : float or None
    distance, angle : float or None
        The error of the pose, metres and degrees.
    read : float or None
        Share of the beams that read what the map shows from the pose.
    covariance : 6 numbers or None
        Its upper triangle by rows.
    nees : float or None
        Squared error over the stated covariance.
    walls, matched, missing : int
        Walls of the map among the correspondences, correspondences, map segments that should have been seen.
    scan_segments, map_segments : int
    inlier_fraction, score, runner_up, margin, chi2, reliability : float or None
        As the answer's diagnostics name them.
    dof : int or None
    alternatives : int
    complete : bool
    milliseconds : float
        Processor time of `associate`.
    """

    world: str
    condition: str
    number: int
    held_out: bool
    form: str
    truth: list[float] | None
    pose: list[float] | None
    status: str
    usable: bool
    reasons: list[str]
    probability: float | None
    distance: float | None
    angle: float | None
    read: float | None
    covariance: list[float] | None
    nees: float | None
    walls: int
    matched: int
    missing: int
    scan_segments: int
    map_segments: int
    inlier_fraction: float | None
    score: float | None
    runner_up: float | None
    margin: float | None
    chi2: float | None
    reliability: float | None
    dof: int | None
    alternatives: int
    complete: bool
    milliseconds: float

    @property
    def stranger(self) -> bool:
        """Return whether no answer is right."""
        return not in_map(self.condition)

    @property
    def right(self) -> bool:
        """Return whether the pose lies within 0.3 m and 3 degrees of the truth."""
        return self._within(DISTANCE, ANGLE)

    @property
    def fine(self) -> bool:
        """Return whether the pose lies within 0.1 m and 1 degree of the truth."""
        return self._within(FINE_DISTANCE, FINE_ANGLE)

    @property
    def wrong(self) -> bool:
        """Return whether a robot would go by a pose that is not right."""
        return self.usable and not self.right

    @property
    def said_elsewhere(self) -> bool:
        """Return whether the answer reports that the robot is not on the map."""
        return self.status == Status.NO_MATCH or "not_on_map" in self.reasons

    def _within(self, distance: float, angle: float) -> bool:
        off = self.distance, self.angle
        return off[0] is not None and off[0] < distance and off[1] is not None and off[1] < angle


def answer(question: Question, form: str) -> WorldOutcome:
    """Search one form of a question's scan."""
    start = time.thread_time()
    result = associate(question.index, question.scans[form], question.prior)
    took = 1e3 * (time.thread_time() - start)
    case = question.case
    distance, angle = None, None
    if case.truth is not None and result.pose is not None:
        distance, angle = offset(result.pose, case.truth)
    return WorldOutcome(
        world=case.world,
        condition=case.condition,
        number=case.number,
        held_out=kept_for_report(case.world),
        form=form,
        truth=_listed(case.truth),
        pose=_listed(result.pose),
        status=str(result.status),
        usable=result.usable,
        reasons=[reason.code for reason in result.reasons],
        probability=result.probability,
        distance=distance,
        angle=angle,
        read=None if result.pose is None else share_read(case, result.pose),
        covariance=None if result.covariance is None else result.covariance[np.triu_indices(3)].tolist(),
        nees=_nees(result, case.truth),
        walls=_walls(question, result),
        matched=len(result.correspondences),
        missing=len(result.missing_map),
        scan_segments=len(question.scans[form].measured),
        map_segments=len(case.map),
        alternatives=len(result.alternatives),
        complete=result.search.complete,
        milliseconds=took,
        **_diagnostics(result),
    )


def _diagnostics(result: AssociationResult) -> dict[str, Any]:
    """Return the answer's diagnostics by name, None where there are none."""
    if result.diagnostics is None:
        return dict.fromkeys((*DIAGNOSTICS, *OF_THE_REGISTRATION))
    return {name: getattr(result.diagnostics, name) for name in (*DIAGNOSTICS, *OF_THE_REGISTRATION)}


def share_read(case: Case, pose: RigidTransform) -> float:
    """Return the share of a scan's beams that read what the map shows from a pose."""
    return share_that_reads(case.map, case.scanner, case.ranges, pose)


def share_that_reads(shown: Segments, scanner: Scanner, ranges: np.ndarray, pose: RigidTransform) -> float:
    """Return the share of the beams that read what is shown from a pose, which is in the frame of that.

    A beam may read what its neighbours should: at an edge half a beam decides. One without return reads right where
    the map shows nothing within reach. Beams of which nothing is known do not count.
    """
    slack = SIGMAS * scanner.sigma + TOLERANCE
    expected = scan(shown, pose, replace(scanner, sigma=0.0)).true_ranges
    first, last = (expected[-1:], expected[:1]) if _full_turn(scanner) else (expected[:1], expected[-1:])
    around = np.stack([expected, np.concatenate([first, expected[:-1]]), np.concatenate([expected[1:], last])])
    known = ~np.isnan(ranges)
    nothing = (ranges > scanner.range_max - slack) & (around.max(axis=0) > scanner.range_max - slack)
    measured = np.where(np.isfinite(ranges), ranges, -np.inf)
    close = (np.abs(around - measured) <= slack).any(axis=0)
    return float((nothing | close)[known].mean()) if known.any() else 0.0


def _full_turn(scanner: Scanner) -> bool:
    return abs(scanner.angle_increment) * (scanner.beams + 0.5) > math.tau


def _walls(question: Question, result: AssociationResult) -> int:
    """Count the walls of the map that an answer rests on."""
    matched = sorted({pair.map for pair in result.correspondences})
    return len(set(wall_of_segment(question.case.map)[matched].tolist()))


def _nees(result: AssociationResult, truth: RigidTransform | None) -> float | None:
    if truth is None or result.pose is None or result.covariance is None:
        return None
    turn = wrap_angle(result.pose.theta - truth.theta)
    error = np.array([result.pose.x - truth.x, result.pose.y - truth.y, turn])
    return float(error @ np.linalg.solve(result.covariance, error))


def _listed(pose: RigidTransform | None) -> list[float] | None:
    return None if pose is None else [pose.x, pose.y, pose.theta]


def write(path: Path, outcomes: Iterable[WorldOutcome]) -> None:
    """Write outcomes as JSON, one a line."""
    with path.open("wb") as file:
        for outcome in outcomes:
            file.write(orjson.dumps(asdict(outcome), option=orjson.OPT_APPEND_NEWLINE))


def read(path: Path) -> Iterator[WorldOutcome]:
    """Read what `write` wrote."""
    with path.open("rb") as file:
        for line in file:
            yield WorldOutcome(**orjson.loads(line))
