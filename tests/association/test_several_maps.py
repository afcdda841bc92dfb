"""One scan on several maps: the right map is found, equal maps are ambiguous, another building is on none of them."""

from __future__ import annotations

import itertools
import math
from functools import cache
from typing import Any

import numpy as np
import pytest

from association import AssociationOptions as Options
from association import (
    AssociationResult,
    HardPrior,
    KnownOfMaps,
    MapIndex,
    MapPart,
    MapSet,
    Scan,
    SoftPrior,
    Status,
    View,
    assemble,
    associate,
    associate_on_maps,
)
from registration import MeasuredSegments, RigidTransform, Segments

from .scenes import Floats, box, drawn_room, known, pose, ranges, reason_codes, ring, same_pose, without_beams

TRUTH = pose(9.0, 6.0, 0.7)  # in the corridor
NAMES = tuple(f"floor-{k}" for k in range(5))


@cache
def floor(seed: int) -> Floats:
    """Draw a floor: outer walls and a corridor along the middle as all of them have, and blocks on both sides."""
    rng, blocks = np.random.default_rng([60, seed]), []
    for row in (0.0, 7.0):
        x = 0.8
        while x < 20.0:
            width = rng.uniform(1.5, 4.5)
            height, gap = rng.uniform(2.0, 3.6), rng.uniform(0.8, 2.0)
            blocks.append(box(x, row + rng.uniform(0.4, 0.7), width, height))
            x += width + gap
    return np.vstack([ring([(0, 0), (26, 0), (26, 12), (0, 12)]), *blocks])


@cache
def seen_on(seed: int) -> Scan:
    return ranges(floor(seed), TRUTH, seed)


def part(walls: Floats, **how: Any) -> MapPart:
    return MapPart(Segments.from_array(walls), **how)


@cache
def building() -> MapSet:
    return MapSet({name: part(floor(k)) for k, name in enumerate(NAMES)})


def probabilities(result: AssociationResult) -> float:
    return sum(one.probability or 0.0 for one in result.maps)


def test_the_floor_is_found_among_floors_that_share_their_outer_walls() -> None:
    usable = 0
    for k, name in enumerate(NAMES):
        for scan in (seen_on(k), without_beams(seen_on(k))):
            found = associate_on_maps(building(), scan)
            assert found.map_id == found.maps[0].map_id
            assert {one.map_id for one in found.maps} == set(NAMES)
            scores = [one.score for one in found.maps if one.score is not None]
            assert scores == sorted(scores, reverse=True)
            assert probabilities(found) <= 1.0 + 1e-9
            right = found.map_id == name and same_pose(found.pose, TRUTH, 0.05)
            assert right or not found.usable
            assert not found.usable or f"on the map {name}" in found.message
            usable += found.usable
    assert usable >= 8


@pytest.mark.parametrize("number", [0, 4])
def test_the_answer_is_that_of_the_map_alone_in_its_frame_and_indices(number: int) -> None:
    """A wall across the corridor is gone since."""
    far = np.array([500_000.0, -4_000_000.0])
    gone = [[14.0, 5.0, 14.0, 7.0], [14.0, 7.0, 14.0, 5.0]]
    mapped = [np.vstack([floor(k), gone]) + np.tile(k * far, 2) for k in range(5)]
    alone = associate(MapIndex.build(Segments.from_array(mapped[number])), seen_on(number))
    among = associate_on_maps(MapSet({str(k): part(one) for k, one in enumerate(mapped)}), seen_on(number))
    assert among.map_id == str(number)
    assert same_pose(among.pose, alone.pose, 1e-6, 1e-6)
    np.testing.assert_allclose(known(among.covariance), known(alone.covariance), rtol=1e-5)
    assert [(a.scan, a.map) for a in among.correspondences] == [(a.scan, a.map) for a in alone.correspondences]
    assert among.missing_map == alone.missing_map
    assert {len(mapped[number]) - 2, len(mapped[number]) - 1} & set(among.missing_map)


def test_equal_floors_are_ambiguous_and_both_are_listed() -> None:
    """Each in the frame of its own map."""
    there = floor(0) + np.tile([1000.0, -2000.0], 2)
    found = associate_on_maps(MapSet({"a": part(floor(0)), "b": part(there), "c": part(floor(1))}), seen_on(0))
    assert (found.status, found.usable) == (Status.AMBIGUOUS, False)
    other = ({"a", "b"} - {found.map_id}).pop()
    assert found.alternatives[0].map_id == other
    places = {found.map_id: known(found.pose), other: found.alternatives[0].pose}
    for one in found.maps[:2]:
        assert one.status is Status.AMBIGUOUS
        assert same_pose(one.pose, places[one.map_id], 0.05)
    assert same_pose(places["a"], TRUTH, 0.05)
    assert same_pose(places["b"], pose(TRUTH.x + 1000.0, TRUTH.y - 2000.0, TRUTH.theta), 0.05)
    (reason,) = [one for one in found.reasons if one.code == "similar_place"]
    assert f"the map {other}" in reason.message
    assert f"on the map {other}" in found.message
    assert known(found.probability) <= 0.5


def test_another_floor_or_building_is_on_none_of_them() -> None:
    rooms = [drawn_room(np.random.default_rng([61, k])) for k in range(8)]
    for scan in (*map(seen_on, range(5, 9)), *(ranges(room, at, k) for k, (room, at) in enumerate(rooms))):
        found = associate_on_maps(building(), scan)
        assert not found.usable
        assert found.reasons


WEIGHTS: list[dict[str, float] | None] = [None, {"a": 0.1, "b": 0.8, "c": 0.1}, {"b": 0.98}, {"b": 0.998}]


def variants(seed: int) -> tuple[MapSet, Scan]:
    """Draw a room that three maps have with another place of its pillar, and a scan of the first."""
    room, at = drawn_room(np.random.default_rng([71, seed]))
    rng, rooms = np.random.default_rng([70, seed, 1]), []
    for _ in range(3):
        other = room.copy()
        other[-4:] += np.tile(rng.uniform(-0.6, 0.6, 2), 2)
        rooms.append(other)
    scan = ranges(rooms[0], at, seed, reach=(20.0, 5.0)[seed % 2])
    return MapSet({name: part(one) for name, one in zip("abc", rooms, strict=True)}), scan


def test_probabilities_sum_to_at_most_one_and_statuses_agree_with_reasons() -> None:
    """Those of the maps, and those of the answer and its alternatives; no map without match is a similar place."""
    named = 0
    for seed in range(25, 43):
        maps, scan = variants(seed)
        for sent, given in itertools.product((scan, without_beams(scan)), WEIGHTS):
            found = associate_on_maps(maps, sent, KnownOfMaps(map_weights=given))
            assert probabilities(found) <= 1.0 + 1e-9
            others = sum(one.probability or 0.0 for one in found.alternatives)
            assert (found.probability or 0.0) + others <= 1.0 + 1e-9
            statuses = {one.map_id: one.status for one in found.maps}
            assert not found.usable or statuses[found.map_id or ""] is Status.OK
            assert all(one.status is Status.NO_MATCH or one.pose is not None for one in found.maps)
            for reason in found.reasons:
                named_there = reason.message.split(" fit ")[0] if reason.code == "similar_place" else ""
                on = [name for name in "abc" if name in named_there.replace(",", "").split()[2:]]
                assert all(statuses[name] is not Status.NO_MATCH for name in on)
                named += len(on)
    assert named > 0


def test_weights_decide_between_equal_floors_and_are_not_fused() -> None:
    maps = MapSet({"a": part(floor(0)), "b": part(floor(0))})
    plain = associate_on_maps(maps, seen_on(0))
    for name in ("a", "b"):
        found = associate_on_maps(maps, seen_on(0), KnownOfMaps(map_weights={name: 0.9999}))
        assert found.map_id == name
        assert known(found.pose).x == pytest.approx(known(plain.pose).x, abs=1e-9)
        first, second = found.maps
        assert known(first.score) - known(second.score) == pytest.approx(math.log(0.9999 / 0.0001), abs=1e-6)


def test_weights_do_not_overrule_the_scan() -> None:
    found = associate_on_maps(building(), seen_on(0), KnownOfMaps(map_weights={"floor-3": 1.0}))
    assert not found.usable
    assert "prior_contradicted" in reason_codes(found)


@pytest.mark.parametrize("hard", [True, False])
def test_a_prior_is_on_its_map(hard: bool) -> None:
    maps = MapSet({"a": part(floor(0)), "b": part(floor(0))})
    prior = HardPrior(TRUTH, 1.0, 0.5) if hard else SoftPrior(TRUTH, np.diag([0.1, 0.1, 0.05]))
    for name in ("a", "b"):
        found = associate_on_maps(maps, seen_on(0), KnownOfMaps(prior, name))
        assert found.map_id == name
        assert same_pose(found.pose, TRUTH)


def test_a_scan_wider_than_the_maps_is_on_none_of_them() -> None:
    """It does not reach from one to another."""
    ends = Segments.from_array([[0.0, 0.0, 400.0, 0.0], [400.0, 0.0, 400.0, 30.0]])
    assert not associate_on_maps(building(), Scan(MeasuredSegments.from_segments(ends))).usable


def test_parts_of_an_answer_are_left_out_as_of_one_map() -> None:
    found = associate_on_maps(building(), seen_on(0), options=Options(include=("alternatives",)))
    assert (found.map_id, found.correspondences, found.missing_map) == ("floor-0", (), ())


def test_one_map_alone_is_a_set_as_well() -> None:
    alone = associate(MapIndex.build(Segments.from_array(floor(2))), seen_on(2))
    found = associate_on_maps(MapSet({"only": part(floor(2))}), seen_on(2))
    assert (found.map_id, found.status, len(found.maps)) == ("only", alone.status, 1)
    assert found.probability == pytest.approx(alone.probability, abs=1e-6)
    assert same_pose(found.pose, alone.pose, 1e-6, 1e-6)


def test_the_order_of_the_maps_does_not_matter() -> None:
    names = [NAMES[k] for k in (3, 0, 4, 2, 1)]
    other = MapSet({name: part(floor(NAMES.index(name))) for name in names})
    for k in range(3):
        one, two = (associate_on_maps(maps, seen_on(k)) for maps in (building(), other))
        assert (one.map_id, one.status, one.usable) == (two.map_id, two.status, two.usable)
        assert one.probability == pytest.approx(two.probability, abs=1e-6)
        assert same_pose(one.pose, two.pose, 1e-6, 1e-6)


def test_maps_without_directions_and_maps_with_them_may_be_mixed() -> None:
    """Then directions mean nothing on any."""
    reversed_floor = floor(1)[:, [2, 3, 0, 1]]
    maps = MapSet({"a": part(floor(0)), "b": part(reversed_floor, oriented=False)})
    found = associate_on_maps(maps, seen_on(1), options=Options(oriented=False))
    assert found.map_id == "b"
    assert same_pose(found.pose, TRUTH)


def test_views_of_a_drive_are_all_on_one_map() -> None:
    step = RigidTransform(-1.5, 0.2, 0.1)
    before = ranges(floor(4), TRUTH.compose(step), 9)
    found = associate_on_maps(
        building(), assemble([View(seen_on(4)), View(before, step, np.diag([1e-4, 1e-4, 1e-5]), 0)])
    )
    assert found.map_id == "floor-4"
    assert same_pose(found.pose, TRUTH, 0.05)
    assert all(0 <= pair.map < len(floor(4)) for pair in found.correspondences)
    assert {pair.scan for pair in found.correspondences} & set(range(len(seen_on(4).measured), 1000))
