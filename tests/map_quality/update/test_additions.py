"""New walls from the lines of several scans, and walls of the map that beams pass."""

from __future__ import annotations

import numpy as np
import pytest

from association import Deadline
from map_quality.update.additions import SeenLines, candidates
from map_quality.update.beams import Chunks
from map_quality.update.changes import draft_changes
from map_quality.update.evidence import WallEvidence
from registration import Segments

MAP = Segments.derived(np.array([[50.0, 50.0, 60.0, 50.0]]))
WALL = [0.0, 0.0, 5.0, 0.0]


def seen(*lines: list[float]) -> SeenLines:
    """Return lines that each of two visits shows from three places."""
    ends = np.array([line for line in lines for _ in range(6)])
    visits = np.array([k % 2 for _ in lines for k in range(6)])
    places = np.array([(k % 3, 0) for _ in lines for k in range(6)])
    return SeenLines(Segments.derived(ends), visits, places, np.full(len(ends), 1e4))


def added(*lines: list[float], passed: float | None = None) -> np.ndarray:
    """Return the walls that two visits add from three places; beams pass through those at `passed`, their y."""
    new, sigmas = candidates(seen(*lines), MAP, Deadline())
    chunks = Chunks.of(Segments.derived(np.concatenate([MAP.endpoints, new])))
    wall = np.repeat(np.arange(len(chunks.walls)), chunks.counts)
    on = np.full(len(wall), True) if passed is None else np.abs(chunks.walls.midpoints[wall, 1] - passed) > 0.06
    chunk, scan = np.divmod(np.arange(6 * len(wall)), 6)
    counts = np.stack([9 * ~on[chunk], 9 * on[chunk], 0 * chunk], axis=1)
    evidence = WallEvidence(chunks, (), chunk, scan % 2, scan % 3, counts)
    drafts = draft_changes(evidence, MAP, sigmas, 0.005, ["monday", "tuesday"], Deadline())
    return np.concatenate([one.change.new for one in drafts if one.change.code == "added"])


@pytest.mark.parametrize("across", [0.18, -0.18])
def test_a_line_close_before_or_behind_a_new_wall_is_the_same_wall(across: float) -> None:
    walls = added(WALL, [2.0, across, 4.0, across])
    assert walls.shape == (1, 4)
    assert np.abs(walls - [WALL]).max() < 0.06


def test_a_line_that_beams_pass_through_hides_no_wall_close_to_it() -> None:
    """A shut door lies between the faces of its wall; lines across an open one continue these faces."""
    door = [2.0, 0.18, 4.0, 0.18]
    walls = added(WALL, door, passed=0.0)
    assert walls.shape == (1, 4)
    assert np.abs(walls - [door]).max() < 0.06


@pytest.mark.parametrize(
    "other",
    [
        [2.0, 0.4, 4.0, 0.4],  # farther off
        [5.4, 0.18, 7.0, 0.18],  # next to it: a step
        [4.0, -0.18, 2.0, -0.18],  # the other face of a thin wall
    ],
)
def test_other_lines_are_walls_of_their_own(other: list[float]) -> None:
    assert np.abs(added(WALL, other) - [WALL, other]).max() < 0.06


def test_single_beams_do_not_remove_a_wall_whose_rest_nothing_reads() -> None:
    """Beams of two visits pass one third of it, single beams another third: the first third is gone."""
    chunks = Chunks.of(MAP)
    many, single = np.repeat(np.arange(10, 28), 6), np.arange(30, 48)
    scan = np.concatenate([np.tile(np.arange(6), 18), np.zeros(18, dtype=int)])
    counts = np.zeros((len(scan), 3), dtype=int)
    counts[:, 0] = [9] * len(many) + [1] * len(single)
    evidence = WallEvidence(chunks, (), np.concatenate([many, single]), scan % 2, scan % 3, counts)
    drafts = draft_changes(evidence, MAP, np.zeros(0), 0.005, ["monday", "tuesday"], Deadline())
    (draft,) = drafts
    assert draft.change.code == "shortened"
    assert draft.change.new == pytest.approx(np.array([[50.0, 50.0, 52.0, 50.0], [55.6, 50.0, 60.0, 50.0]]))
