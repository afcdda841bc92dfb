"""Poses: what is refused."""

from __future__ import annotations

import math

import pytest

from registration import RigidTransform


@pytest.mark.parametrize("turns", [-3.75, -1.0, 0.25, 2.25])
def test_some_turns_are_wrapped(turns: float) -> None:
    assert RigidTransform(1.0, 2.0, turns * math.tau).theta == pytest.approx(math.remainder(turns, 1.0) * math.tau)


@pytest.mark.parametrize("theta", [30.0, -90.0])
def test_degrees_are_refused(theta: float) -> None:
    with pytest.raises(ValueError, match=r"found -?[39]0; if these are degrees, give -?[01]"):
        RigidTransform(1.0, 2.0, theta)
