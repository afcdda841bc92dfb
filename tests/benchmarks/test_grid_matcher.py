"""The matcher for grids finds what trying every pose finds."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.peers.grid_matcher import GridMatcher
from registration import RigidTransform

RESOLUTION = 0.1
ORIGIN = RigidTransform(-2.0, 5.0, 0.0)


def room() -> tuple[np.ndarray, np.ndarray]:
    """Return the occupied and the free cells of an L-shaped room."""
    free = np.zeros((48, 64), bool)
    free[4:40, 4:56] = True
    free[24:40, 36:56] = False
    occupied = np.zeros_like(free)
    for shift in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        occupied |= np.roll(free, shift, (0, 1)) & ~free
    return occupied, free


def cast(occupied: np.ndarray, x: float, y: float, theta: float) -> tuple[np.ndarray, np.ndarray]:
    """Return angles and ranges of beams that end in the middle of the first occupied cell, from a place in cells."""
    angles = np.linspace(-math.pi, math.pi, 120, endpoint=False)
    reach = np.arange(0.0, 80.0, 0.05)
    rows = (y + reach * np.sin(angles[:, None] + theta)).astype(int).clip(0, occupied.shape[0] - 1)
    columns = (x + reach * np.cos(angles[:, None] + theta)).astype(int).clip(0, occupied.shape[1] - 1)
    return angles, (reach[occupied[rows, columns].argmax(axis=1)] + 0.5) * RESOLUTION


LONG = pytest.mark.long


@pytest.mark.parametrize(
    ("x", "y", "theta"),
    [(12.5, 30.5, 0.4), pytest.param(45.5, 10.5, -2.0, marks=LONG), pytest.param(20.5, 8.5, 3.0, marks=LONG)],
)
def test_the_pose_is_found(x: float, y: float, theta: float) -> None:
    occupied, free = room()
    found = GridMatcher(occupied, free, RESOLUTION, ORIGIN).match(*cast(occupied, x, y, theta))
    assert found.pose is not None
    assert math.hypot(found.pose.x - (x * RESOLUTION - 2.0), found.pose.y - (y * RESOLUTION + 5.0)) < 0.15
    assert abs(math.remainder(found.pose.theta - theta, math.tau)) < math.radians(3.0)
    assert found.usable


def test_a_room_of_two_equal_halves_leaves_no_lead() -> None:
    free = np.zeros((40, 60), bool)
    free[4:36, 4:56] = True
    occupied = (np.roll(free, 1, 0) | np.roll(free, -1, 0) | np.roll(free, 1, 1) | np.roll(free, -1, 1)) & ~free
    found = GridMatcher(occupied, free, RESOLUTION, ORIGIN).match(*cast(occupied, 15.5, 12.5, 0.3))
    assert found.lead < 0.05
    assert not found.usable


def test_without_returns_there_is_no_pose() -> None:
    found = GridMatcher(*room(), RESOLUTION, ORIGIN).match(np.zeros(0), np.zeros(0))
    assert found.pose is None
    assert not found.usable
