"""Lines that are parallel within what is known of their angles."""

from __future__ import annotations

import numpy as np
import pytest

from registration import MeasuredSegments, RegistrationOptions, Segments, register

from .scenes import diagonal, noisy_pairs


def parallel(degrees: list[float], sigma: float, lengths: tuple[float, ...] = (4.0, 4.0, 4.0)) -> bool:
    """Tell whether lines of these directions are parallel within the noise of their scan."""
    a = np.radians(degrees)
    directions = np.stack([np.cos(a), np.sin(a)], axis=1)
    begins = np.array([[0.0, 0.0], [5.0, 5.0], [-3.0, 8.0]])[: len(a)]
    reach = np.array(lengths[: len(a)])[:, None]
    segments = Segments.from_array(np.hstack([begins, begins + reach * directions]))
    found = register(segments, MeasuredSegments.from_segments(segments, sigma), diagonal(len(a)))
    return found.diagnostics.dof == 2 * len(a) - 2


@pytest.mark.parametrize(
    ("degrees", "sigma", "expected"),
    [
        ([0, 180, 0], 0.02, True),
        ([0, 90], 0.02, False),
        # An angle is known to 0.02 / sqrt(80 * 4^2 / 12) rad = 0.111 degrees, so a difference of two to 0.157.
        ([0, 0.45], 0.02, True),
        ([0, 0.49], 0.02, False),
        ([0, 0.49], 0.03, True),
        # The deviations from the mean are 0, 0.4 and 0.4 degrees: 26 where noise stays below 11.8.
        ([0, 0.4, -0.4], 0.02, False),
        ([0, 0.25, -0.25], 0.02, True),
    ],
)
def test_parallel_within_three_standard_deviations(degrees: list[float], sigma: float, expected: bool) -> None:
    assert parallel(degrees, sigma) is expected


@pytest.mark.parametrize(("degrees", "expected"), [(8.0, True), (16.0, False)])
def test_a_line_counts_as_it_knows_its_angle(degrees: float, expected: bool) -> None:
    """The angle of a piece of 0.4 m is known to 3.5 degrees."""
    assert parallel([0.0, 0.0, degrees], 0.02, (4.0, 4.0, 0.4)) is expected


def test_fewer_than_two_that_count_are_parallel() -> None:
    map_segments, scan = noisy_pairs(np.random.default_rng(0), 3)
    for weights, dof in ([0.0, 1e30, 0.0], 0), ([1e30, 1e30, 0.0], 1):
        options = RegistrationOptions(weights=weights)
        assert register(map_segments, scan, diagonal(3), 0.0, options).diagnostics.dof == dof
