"""New walls from the lines of several scans."""

from __future__ import annotations

import numpy as np
import pytest

from map_quality.update.additions import SeenLines, candidates
from registration import Segments

NO_MAP = Segments.derived(np.zeros((0, 4)))
WALL = [0.0, 0.0, 5.0, 0.0]


def seen(*lines: list[float]) -> SeenLines:
    """Return lines that each of two visits shows from three places."""
    ends = np.array([line for line in lines for _ in range(6)])
    visits = np.array([k % 2 for _ in lines for k in range(6)])
    places = np.array([(k % 3, 0) for _ in lines for k in range(6)])
    return SeenLines(Segments.derived(ends), visits, places, np.full(len(ends), 1e4))


@pytest.mark.parametrize("across", [0.18, -0.18])
def test_a_line_close_before_or_behind_a_new_wall_is_the_same_wall(across: float) -> None:
    walls, sigmas = candidates(seen(WALL, [2.0, across, 4.0, across]), NO_MAP)
    assert np.abs(walls - [WALL]).max() < 0.06
    assert len(sigmas) == 1


@pytest.mark.parametrize(
    "other",
    [
        [2.0, 0.4, 4.0, 0.4],  # farther off
        [5.4, 0.18, 7.0, 0.18],  # next to it: a step
        [4.0, -0.18, 2.0, -0.18],  # the other face of a thin wall
    ],
)
def test_other_lines_are_walls_of_their_own(other: list[float]) -> None:
    walls, _ = candidates(seen(WALL, other), NO_MAP)
    assert np.abs(walls - [WALL, other]).max() < 0.06
