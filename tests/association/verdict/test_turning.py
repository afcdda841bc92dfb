"""The angles of a scan are distorted if the robot turns meanwhile, or if the angle between beams is wrong."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from association import MapIndex, Scan, associate
from association.rank_and_estimate import estimate_at
from association.verdict.inconsistencies import turn_during_scan
from registration import RigidTransform, Segments
from simulation import Scanner
from simulation import scan as simulate
from vectorization import LaserScan, vectorize

from ..scenes import INSIDE, ROOM, beams_of, context_of, index_of, scan_of, seen

FAN = math.radians(270.0)
BEAMS = 811


def sent(turn: float) -> Scan:
    """Return a scan of the room whose beams go `turn` radians farther, in all, than is declared."""
    step = FAN / (BEAMS - 1)
    real = 1.0 + turn / FAN
    scanner = Scanner(beams=BEAMS, angle_min=-0.5 * FAN * real, angle_increment=step * real, sigma=0.005)
    walls = Segments.from_array(ROOM)
    ranges = simulate(walls, INSIDE, scanner, np.random.default_rng(1)).ranges
    seen = vectorize(LaserScan(-0.5 * FAN, step, ranges, 0.0, scanner.range_max))
    return Scan(seen.measured, (0.0, 0.0), seen.beams)


def turned(scan: Scan) -> float:
    context = context_of(index_of(ROOM), scan)
    answer = estimate_at(context, INSIDE).answer
    assert answer is not None
    return turn_during_scan(context, answer.best)


@pytest.mark.parametrize("degrees", [-8.0, -4.0, 4.0, 8.0])
def test_the_turn_is_estimated(degrees: float) -> None:
    assert math.degrees(turned(sent(math.radians(degrees)))) == pytest.approx(abs(degrees), rel=0.25)


def test_a_robot_at_rest_does_not_turn() -> None:
    assert turned(sent(0.0)) == 0.0


def test_rounding_is_no_turn() -> None:
    """Without any noise the residuals are as small as the rate."""
    for degrees in range(0, 360, 10):
        here = RigidTransform(INSIDE.x, INSIDE.y, math.radians(degrees))
        index = index_of(ROOM)
        context = context_of(index, scan_of(seen(ROOM, here)[0], viewpoint=(0.0, 0.0), beams=beams_of(index, here)))
        answer = estimate_at(context, here).answer
        assert answer is not None
        assert turn_during_scan(context, answer.best) == 0.0


def test_such_an_answer_is_not_usable_and_says_why() -> None:
    index = MapIndex.build(Segments.from_array(ROOM), 0.01)
    assert associate(index, sent(0.0)).usable
    answer = associate(index, sent(math.radians(6.0)))
    assert not answer.usable
    (reason,) = (one for one in answer.reasons if one.code == "map_mismatch")
    assert "`twist`" in reason.message


def test_the_time_of_a_segment_is_unknown_without_ranges_or_their_order() -> None:
    scan = sent(math.radians(6.0))
    assert turned(Scan(scan.measured, (0.0, 0.0))) == 0.0
    assert turned(replace(scan, ordered=False)) == 0.0


def test_a_pose_far_from_the_map_frame_changes_nothing() -> None:
    by = RigidTransform(3.0, -2.0, 2.9)
    walls = by.apply(ROOM.reshape(-1, 2, 2)).reshape(-1, 4)
    context = context_of(index_of(walls), sent(math.radians(6.0)))
    answer = estimate_at(context, by.compose(INSIDE)).answer
    assert answer is not None
    assert math.degrees(turn_during_scan(context, answer.best)) == pytest.approx(6.0, rel=0.25)
