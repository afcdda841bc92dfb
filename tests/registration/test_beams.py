"""Range measurements in other frames."""

from __future__ import annotations

import math

import numpy as np

from registration import Beams, RigidTransform

ANGLES, RANGES = np.array([-0.5, 0.25, 1.0]), np.array([2.0, math.inf, 3.0])
ORIGINS = np.array([[0.0, 1.0], [2.0, 3.0], [4.0, -5.0]])


def test_left_and_right_are_exchanged() -> None:
    """The angles rise as before; a second time makes them as they were."""
    beams = Beams(ANGLES, RANGES, 10.0, ORIGINS)
    mirrored = beams.mirrored()
    np.testing.assert_array_equal(mirrored.angles, [-1.0, -0.25, 0.5])
    np.testing.assert_array_equal(mirrored.ranges, [3.0, math.inf, 2.0])
    np.testing.assert_array_equal(mirrored.origins, [[4.0, 5.0], [2.0, -3.0], [0.0, -1.0]])
    again = mirrored.mirrored()
    for got, expected in ((again.angles, ANGLES), (again.ranges, RANGES), (again.origins, ORIGINS)):
        np.testing.assert_array_equal(got, expected)
    assert (mirrored.range_max, Beams(ANGLES, RANGES, 10.0).mirrored().origins) == (10.0, None)


def test_lengths_are_multiplied() -> None:
    scaled = Beams(ANGLES, RANGES, 10.0, ORIGINS).scaled(2.0)
    np.testing.assert_array_equal(scaled.angles, ANGLES)
    np.testing.assert_array_equal(scaled.ranges, [4.0, math.inf, 6.0])
    np.testing.assert_array_equal(scaled.origins, 2.0 * ORIGINS)
    assert scaled.range_max == 20.0


def test_each_beam_is_moved_with_its_origin_or_that_of_all() -> None:
    by = RigidTransform(1.0, 2.0, 0.5 * math.pi)
    for origins in (ORIGINS, np.tile([3.0, 1.0], (3, 1))):
        moved = Beams(ANGLES, RANGES, 10.0, None if origins is not ORIGINS else ORIGINS).moved(by, (3.0, 1.0))
        np.testing.assert_allclose(moved.angles, ANGLES + 0.5 * math.pi)
        np.testing.assert_array_equal(moved.ranges, RANGES)
        assert moved.origins is not None
        expected = np.stack([1.0 - origins[:, 1], 2.0 + origins[:, 0]], axis=1)
        np.testing.assert_allclose(moved.origins, expected, atol=1e-12)
