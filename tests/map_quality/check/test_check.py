"""Doubtful parts of a map are found, and nothing in maps without them."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest

from association import CancelledError, Deadline, MapIndex
from map_quality import MapCheck, check_map
from registration import Segments
from registration.layout import Floats
from simulation import OfficePlan, offices

from .drawn import centre_lines, faces, index_of, reversed_ends

# A room with a niche, a wall with two faces in it, free space on the left.
ROOM = np.array(
    [
        [0, 0, 8, 0], [8, 0, 8, 4], [8, 4, 6, 4], [6, 4, 6, 6], [6, 6, 0, 6], [0, 6, 0, 0],
        [2, 2, 2, 4], [2, 4, 2.2, 4], [2.2, 4, 2.2, 2], [2.2, 2, 2, 2],
    ],
    dtype=float,
)  # fmt: skip


def checked(segments: Floats, *, oriented: bool = True) -> MapCheck:
    return check_map(index_of(segments), oriented=oriented)


def found(segments: Floats, *, oriented: bool = True) -> dict[str, tuple[int, ...]]:
    """Return the findings by their codes."""
    return {one.code: one.segments for one in checked(segments, oriented=oriented).findings}


def test_a_map_that_is_right() -> None:
    result = checked(ROOM)
    assert result.findings == ()
    assert (result.advice.sigma, result.advice.oriented) == (None, True)
    assert (result.size.segment_count, result.size.walls) == (10, 10)
    assert (result.size.length, result.size.diagonal) == pytest.approx((28.0 + 4.4, 10.0))
    assert (result.complete, result.places) == (True, ())
    assert result.viewpoints >= 4


def test_every_finding_is_a_sentence() -> None:
    for walls in (ROOM * 1e-2, reversed_ends(ROOM), centre_lines(), np.vstack([ROOM, ROOM + 0.04])):
        for one in checked(walls).findings:
            assert one.message[0].isupper() or one.message[0].isdigit()
            assert one.message.endswith((".", "?"))
            assert all(isinstance(index, int) for index in one.segments)


def test_all_the_wrong_way_round() -> None:
    for walls in (reversed_ends(ROOM), reversed_ends(faces())):
        assert "reversed" in found(walls)
        assert "reversed" not in found(walls, oriented=False)


def test_a_hall_too_wide_to_look_across() -> None:
    """Each wall has both faces; what a ray has not met by the time that it is left may well be there."""
    inside = np.array(
        [[0.0, 0.0, 300.0, 0.0], [300.0, 0.0, 300.0, 300.0], [300.0, 300.0, 0.0, 300.0], [0.0, 300.0, 0.0, 0.0]]
    )
    outside = reversed_ends(1.004 * (inside - 150.0) + 150.0)
    for walls in (np.vstack([inside, outside]), 100.0 * faces()):
        assert "reversed" not in found(walls)
    assert "reversed" in found(reversed_ends(0.1 * inside))


def test_one_the_wrong_way_round() -> None:
    walls = offices(np.random.default_rng(0)).map.endpoints.copy()
    middles = 0.5 * (walls[:, :2] + walls[:, 2:])
    inner = (np.abs(middles - middles.mean(axis=0)) < 0.3 * np.ptp(middles, axis=0)).all(axis=1)
    long = int(np.argmax(np.hypot(*(walls[:, 2:] - walls[:, :2]).T) * inner))
    walls[long] = walls[long, [2, 3, 0, 1]]
    assert found(walls)["mixed_directions"] == (long,)
    assert checked(walls).advice.oriented is None


@pytest.mark.xfail(strict=True, reason="looks_alike is found as well")
def test_lines_without_direction() -> None:
    result = checked(centre_lines())
    assert [one.code for one in result.findings] == ["mixed_directions"]
    assert result.advice.oriented is False
    assert '"oriented": false' in result.findings[0].message
    assert found(centre_lines(), oriented=False) == {}


@pytest.mark.parametrize("seed", range(4))
def test_directions_thrown_away_and_kept(seed: int) -> None:
    walls = offices(np.random.default_rng(seed), OfficePlan(rooms=4, corridors=1)).map.endpoints
    assert checked(walls).advice.oriented is True
    turned = np.random.default_rng(seed).random(len(walls)) < 0.5
    result = checked(np.where(turned[:, None], reversed_ends(walls), walls))
    assert "mixed_directions" in [one.code for one in result.findings]
    assert result.advice.oriented is not True


def test_short_pieces() -> None:
    crumbs = np.array([[4.0, 3.0, 4.05, 3.0], [4.5, 3.0, 4.5, 3.08]])
    assert found(np.vstack([ROOM, crumbs]))["short_pieces"] == (10, 11)
    whole = np.array([[4.0 + 0.05 * k, 3.0, 4.05 + 0.05 * k, 3.0] for k in range(20)])
    assert "short_pieces" not in found(np.vstack([ROOM, whole]))


def test_gaps() -> None:
    walls = ROOM.copy()
    walls[0, 2] = 7.92  # ends before the corner
    walls[3, 3] = 5.0
    walls = np.vstack([walls, [[6, 5.08, 6, 6]]])  # goes on behind a slit
    assert found(walls)["gaps"] == (0, 1, 3, 10)
    walls[0, 2] = 7.0  # a door
    assert found(walls)["gaps"] == (3, 10)


@pytest.mark.parametrize(("sigma", "gaps"), [(None, (0,)), (0.005, (0,)), (0.01, (0,)), (0.025, ())])
def test_gaps_within_the_declared_error_of_a_map_are_none(sigma: float | None, gaps: tuple[int, ...]) -> None:
    """As in the map of a grid: its walls end where their own cells do, and they declare half a cell."""
    walls = ROOM.copy()
    walls[0, 2] = 7.92  # ends before the corner
    index = MapIndex.build(Segments.from_array(walls), sigma)
    assert {one.code: one.segments for one in check_map(index).findings}.get("gaps", ())[:1] == gaps


def test_overlaps() -> None:
    again = np.array([[1.0, 0.0, 3.0, 0.0], [8.0, 1.01, 8.0, 2.0]])
    assert found(np.vstack([ROOM, again])) == {"overlaps": (0, 1, 10, 11)}
    cut = np.vstack([ROOM[1:], np.array([[0, 0, 4, 0], [3.99, 0, 8, 0]])])
    assert "overlaps" not in found(cut)


def test_doubled_faces() -> None:
    same = np.array([[0.5, 0.1, 7.0, 0.1]])  # looks the same way as the wall behind it
    assert found(np.vstack([ROOM, same]))["doubled_faces"] == (0, 10)
    slit = np.array([[7.0, 0.15, 0.5, 0.15]])  # looks at it
    assert found(np.vstack([ROOM, slit]))["doubled_faces"] == (0, 10)


def test_walls_without_thickness() -> None:
    both = np.array([[4.0, 1.0, 4.0, 3.0], [4.0, 3.0, 4.0, 1.0]])
    assert found(np.vstack([ROOM, both])) == {"both_ways": (10, 11)}
    assert checked(np.vstack([ROOM, both])).advice.oriented is True


@pytest.mark.parametrize(("factor", "told"), [(1.0, False), (0.1, True), (1000.0, True)])
def test_a_size_that_no_building_has(factor: float, told: bool) -> None:
    assert ("unlikely_size" in found(ROOM * factor)) is told


@pytest.mark.parametrize("step", [0.05, 0.02, 0.1])
def test_a_raster_says_how_far_lines_are_off(step: float) -> None:
    off = np.array([1.234, -7.77, 1.234, -7.77])
    drawn = offices(np.random.default_rng(1)).map.endpoints
    walls = np.round(drawn / step) * step
    walls = walls[np.hypot(*(walls[:, 2:] - walls[:, :2]).T) > 0.0]
    assert checked(walls + off).advice.sigma == round(step / math.sqrt(12.0), 4)
    assert checked(drawn).advice.sigma is None
    assert checked(walls[:20]).advice.sigma is None


def test_what_looks_alike() -> None:
    """Three equal rooms in a row, and one of its own."""
    room = np.array([[0, 0, 4, 0], [4, 0, 4, 3], [4, 3, 1, 3], [1, 3, 1, 3.5], [1, 3.5, 0, 3.5], [0, 3.5, 0, 0]])
    alike = np.vstack([room + 5.0 * k * np.array([1.0, 0.0, 1.0, 0.0]) for k in range(3)])
    result = checked(np.vstack([alike, ROOM + 20.0]))
    (finding,) = (one for one in result.findings if one.code == "looks_alike")
    assert set(finding.segments) <= set(range(18))
    assert len(finding.segments) > 9
    for place in result.places:
        away = place.similar_pose.x - place.pose.x
        assert abs(round(away / 5.0)) in (1, 2)
        assert away == pytest.approx(5.0 * round(away / 5.0), abs=0.05)
        assert place.similar_pose.y == pytest.approx(place.pose.y, abs=0.05)


def test_maps_far_out_and_of_one_segment() -> None:
    far = ROOM + np.array([5e6, -3e6, 5e6, -3e6])
    assert found(far) == {}
    one = checked(np.array([[0.0, 0.0, 3.0, 0.0]]))
    assert (one.findings, one.advice.oriented, one.complete) == ((), None, True)


def test_a_deadline_ends_it() -> None:
    index = index_of(faces())
    assert not check_map(index, Deadline(time.monotonic())).complete
    gone = Deadline()
    gone.cancel()
    with pytest.raises(CancelledError):
        check_map(index, gone)
