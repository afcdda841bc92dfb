"""Kernels that are not compiled: they see records as compiled ones do, and answer the same."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from compiled.kernels import interpreted
from registration import MeasuredSegments, Segments, register
from registration.layout import Records
from tests.registration.scenes import diagonal, pose_of

ROOT = Path(__file__).parents[2]
INNER = np.dtype([("a", "f8"), ("b", "i8")])
OUTER = np.dtype([("inner", INNER), ("c", "f8")])
ROOM = [[0.0, 0.0, 6.0, 0.0], [6.0, 0.0, 6.0, 2.0], [4.0, 2.0, 4.0, 5.0], [0.0, 5.0, 0.0, 0.0]]
REGISTER = """
import numba
from tests.compiled.test_interpreting import answer
print(numba.config.DISABLE_JIT, *map(float.hex, answer()))
"""


def answer() -> list[float]:
    """Return pose and variance of the angle of a room that is seen 1 m to the right."""
    room, seen = Segments.from_array(ROOM), Segments.from_array(np.array(ROOM) - [1.0, 0.0, 1.0, 0.0])
    found = register(room, MeasuredSegments.from_segments(seen, 0.02), diagonal(len(ROOM)))
    assert found.covariance is not None
    pose = pose_of(found)
    return [pose.x, pose.y, pose.theta, float(found.covariance[2, 2])]


class Both(NamedTuple):
    """Arrays that belong together."""

    outers: Records
    numbers: Records


def whole(outers: Any, one: Any, both: Both) -> Any:
    """Read and write fields in every way that kernels do."""
    outers[1].inner.b = 7
    one.c = 3.0
    both.outers[0].c += one.c
    fresh = np.zeros(1, OUTER)
    fresh[0].inner.a = 5.0
    fresh[0].c = both.outers[0].inner.a + fresh[0].inner.a + both.numbers[0]
    return fresh[0].c


def test_fields_are_attributes_and_writing_reaches_the_array() -> None:
    outers, state = np.zeros(2, OUTER), np.zeros(1, OUTER)
    outers["inner"]["a"] = 2.0
    assert interpreted(whole)(outers, state[0], Both(outers, np.array([10.0]))) == 17.0
    assert outers["inner"]["b"].tolist() == [0, 7]
    assert (outers["c"].tolist(), state["c"].tolist()) == ([3.0, 0.0], [3.0])


def test_a_registration_that_is_not_compiled_gives_the_same_answer() -> None:
    ended = subprocess.run(
        [sys.executable, "-c", REGISTER],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"}, cwd=ROOT, capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    disabled, *numbers = ended.stdout.split()
    assert disabled == "1"
    expected = answer()
    assert expected[0] == pytest.approx(1.0)
    np.testing.assert_allclose([float.fromhex(number) for number in numbers], expected, rtol=1e-12, atol=1e-15)
