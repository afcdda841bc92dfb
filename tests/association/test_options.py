"""Options of a search, and those that it rejects."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from association import AssociationOptions, HardPrior, InvalidSearchError, SoftPrior
from registration.layout import Floats

from .scenes import pose


@pytest.mark.parametrize(
    ("name", "good", "bad"),
    [
        ("max_alternatives", [0, 50], [-1, 51]),
        ("confidence", [0.5, 1.0], [0.49, 1.5, math.nan]),
        ("seed", [0, 2**63 - 1], [-1, 2**63]),
        ("offset_tolerance", [None, 1e-3, 0.4], [0.0, 0.41, 5.0, math.nan]),
        ("angle_tolerance", [None, 1e-3, 0.35], [0.0, 0.36, math.nan]),
        ("min_overlap", [0.0, 1.0], [-0.1, 1.1, math.nan]),
        ("parts", [(), ("alternatives",)], [("segments",)]),
    ],
)
def test_options_have_a_range(name: str, good: list[Any], bad: list[Any]) -> None:
    for value in good:
        assert getattr(AssociationOptions(**{name: value}), name) == value
    for value in bad:
        with pytest.raises(InvalidSearchError) as refused:
            AssociationOptions(**{name: value})
        assert refused.value.argument == f"options.{name}"


@pytest.mark.parametrize(
    "bad",
    [
        np.zeros((3, 3)),
        np.diag([1.0, 1.0, -1.0]),
        np.full((3, 3), math.nan),
        np.eye(2),
        np.array([[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
        np.array([[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
        np.diag([1e-13, 1.0, 1.0]),
        np.diag([1e13, 1.0, 1.0]),
    ],
)
def test_a_prior_takes_a_covariance(bad: Floats) -> None:
    """Of the right shape, finite, symmetric, positive definite and neither tiny nor huge."""
    with pytest.raises(InvalidSearchError) as refused:
        SoftPrior(pose(), bad)
    assert refused.value.argument == "prior.covariance"


def test_a_covariance_may_have_unlike_deviations() -> None:
    scale = np.array([1e-5, 1e5, 1e-2])
    correlated = np.array([[1.0, 0.9, 0.0], [0.9, 1.0, 0.0], [0.0, 0.0, 1.0]])
    assert SoftPrior(pose(), correlated * np.outer(scale, scale)).covariance[0, 0] == pytest.approx(1e-10)


@pytest.mark.parametrize(
    ("radius", "angle", "argument"),
    [
        (0.0, 1.0, "prior.radius"),
        (1e7, 1.0, "prior.radius"),
        (math.nan, 1.0, "prior.radius"),
        (1.0, 0.0, "prior.angle"),
        (1.0, 5.0, "prior.angle"),
    ],
)
def test_a_window_has_a_size(radius: float, angle: float, argument: str) -> None:
    with pytest.raises(InvalidSearchError) as refused:
        HardPrior(pose(), radius, angle)
    assert refused.value.argument == argument


@pytest.mark.parametrize(
    ("at", "inside"),
    [
        (pose(1.0, 2.0, 3.1), True),
        (pose(1.29, 2.39, 3.1), True),
        (pose(1.31, 2.41, 3.1), False),
        (pose(1.0, 2.0, -3.1), True),
        (pose(1.0, 2.0, -2.9), False),
        (pose(1.0, 2.0, 2.9), True),
        (pose(1.0, 2.0, 2.8), False),
    ],
)
def test_a_window_contains_what_is_near_in_place_and_angle(at: Any, inside: bool) -> None:
    assert HardPrior(pose(1.0, 2.0, 3.1), 0.5, 0.25).contains(at) is inside
