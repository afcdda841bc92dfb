import numpy as np
import pytest

from benchmarks.worlds import FAMILIES, wall_of_segment
from benchmarks.worlds.map_errors import clipped, in_pieces, stretched, walls_off
from registration import RigidTransform, Segments
from registration.layout import Floats

# A wall with a doorway, one that faces it, one in line with the first but far off, and one across.
ENDS = [[0.0, 0.0, 2.0, 0.0], [3.0, 0.0, 6.0, 0.0], [6.0, 3.0, 0.0, 3.0], [9.0, 0.0, 12.0, 0.0], [6.0, 0.0, 6.0, 3.0]]
WALLS = Segments.from_array([*ENDS, [6.0, 0.1, 0.0, 0.1]])


def school(seed: int = 1) -> Segments:
    rng = np.random.default_rng(seed)
    return FAMILIES["school"].draw(rng).build(rng).segments


def test_pieces_of_one_wall_are_told_from_walls_in_line() -> None:
    numbers = wall_of_segment(WALLS)
    assert numbers[0] == numbers[1]
    assert len(set(numbers.tolist())) == 5
    assert sorted(set(numbers.tolist())) == [0, 1, 2, 3, 4]
    assert wall_of_segment(Segments.from_array([])).shape == (0,)


def test_walls_are_off_along_their_normals_pieces_together() -> None:
    segments = school()
    drawn = walls_off(segments, np.random.default_rng(2), 0.02)
    off = drawn.segments.offsets - segments.offsets
    along = np.einsum("ij,ij->i", drawn.segments.midpoints - segments.midpoints, segments.directions)
    np.testing.assert_allclose(along, 0.0, atol=1e-9)
    np.testing.assert_allclose(drawn.segments.lengths, segments.lengths)
    numbers = wall_of_segment(segments)
    firsts = np.unique(numbers, return_index=True)[1]
    np.testing.assert_allclose(off, off[firsts][numbers], atol=1e-9)
    assert off[firsts].std() == pytest.approx(0.02, rel=0.15)
    assert len(firsts) < len(segments)


def test_pieces_lie_on_their_wall_without_gaps() -> None:
    segments = school()
    drawn = in_pieces(segments, np.random.default_rng(2), 0.02)
    whole = walls_off(segments, np.random.default_rng(2), 0.02).segments
    assert drawn.segments.lengths.sum() == pytest.approx(whole.lengths.sum())
    assert drawn.segments.lengths.max() <= 3.0 + 1e-9
    assert len(drawn.segments) > len(segments)
    # Each piece is on a line of the map with errors.
    for midpoint, normal in zip(drawn.segments.midpoints[:40], drawn.segments.normals[:40], strict=True):
        parallel = np.abs(whole.normals @ normal - 1.0) < 1e-9
        assert np.abs(whole.offsets[parallel] - normal @ midpoint).min() < 1e-9


@pytest.mark.parametrize("linear", [1.01 * np.eye(2), np.array([[1.0, 0.01], [0.0, 0.99]])])
def test_a_pose_goes_with_its_map(linear: Floats) -> None:
    segments, pose = school(), RigidTransform(3.0, 2.0, 0.4)
    drawn = stretched(segments, linear).laid(np.random.default_rng(5))
    there = drawn.pose(pose)
    # What is 1 m ahead of the scanner lies 1 m ahead in the map, as nearly as one turn can have it.
    for ahead in ([1.0, 0.0], [0.0, 1.0]):
        expected = drawn.linear @ pose.apply(ahead) + drawn.shift
        assert np.hypot(*(there.apply(ahead) - expected)) < 0.013
    np.testing.assert_allclose(drawn.linear @ [3.0, 2.0] + drawn.shift, [there.x, there.y])
    corner = segments.endpoints[7, :2]
    np.testing.assert_allclose(drawn.segments.endpoints[7, :2], drawn.linear @ corner + drawn.shift)


def test_clipping_cuts_walls_at_the_line() -> None:
    kept = clipped(WALLS, np.array([1.0, 0.0]), 4.0)
    expected = [[0, 0, 2, 0], [3, 0, 4, 0], [4, 3, 0, 3], [4, 0.1, 0, 0.1]]
    assert sorted(kept.endpoints.tolist()) == sorted(np.array(expected, dtype=float).tolist())
    assert len(clipped(WALLS, np.array([1.0, 0.0]), -1.0)) == 0
    assert len(clipped(WALLS, np.array([0.0, 1.0]), 99.0)) == len(WALLS)
    assert clipped(WALLS, np.array([0.0, -1.0]), -2.995).endpoints.tolist() == [[6, 3, 0, 3]]
