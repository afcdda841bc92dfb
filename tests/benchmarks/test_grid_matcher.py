"""The matcher for grids finds what trying every pose finds."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import ndimage

from benchmarks.peers.grid_matcher import SIGMA, GridMatcher
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


@LONG
def test_no_other_pose_scores_more() -> None:
    """Of all free cells and headings, by the same points one after the other."""
    occupied, free = room()
    matcher = GridMatcher(occupied, free, RESOLUTION, ORIGIN)
    angles, ranges = cast(occupied, 20.5, 12.5, 1.0)
    angles, ranges = angles[:60], ranges[:60] + np.random.default_rng(0).normal(0.0, 0.1, 60)
    found = matcher.match(angles, ranges)
    likelihood = np.exp(-0.5 * (ndimage.distance_transform_edt(~occupied) * RESOLUTION / SIGMA) ** 2)
    rows, columns = np.nonzero(free)
    best = 0.0
    for theta in np.arange(0.0, math.tau, RESOLUTION / ranges.max()):
        across = np.round(ranges * np.cos(angles + theta) / RESOLUTION).astype(int)
        up = np.round(ranges * np.sin(angles + theta) / RESOLUTION).astype(int)
        r, c = rows[:, None] + up, columns[:, None] + across
        inside = (r >= 0) & (r < occupied.shape[0]) & (c >= 0) & (c < occupied.shape[1])
        values = np.where(inside, likelihood[r.clip(0, len(occupied) - 1), c.clip(0, occupied.shape[1] - 1)], 0.0)
        best = max(best, float(values.mean(axis=1).max()))
    assert found.score == pytest.approx(best, abs=2e-3)


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
