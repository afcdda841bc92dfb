"""One scan on several maps: the right map is found, equal maps are ambiguous, another building is on none of them."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import linefix
from association import (
    AssociationOptions,
    Deadline,
    HardPrior,
    InvalidMapError,
    InvalidSearchError,
    KnownOfMaps,
    MapIndex,
    MapPart,
    MapSet,
    Scan,
    SoftPrior,
    View,
    assemble,
    associate,
    associate_on_maps,
    map_set,
    message_of,
)
from association.index.joint import JointIndex, gap_of, joint_sigma, places_of
from registration import RigidTransform, Segments
from simulation import FLOOR_KINDS, Scanner, draw_floors, scan

SCANNER = Scanner(beams=720, sigma=0.01)
KIND = FLOOR_KINDS["laboratories"]
TRUTH = RigidTransform(20.0, 9.5, 0.7)  # in the corridor


@cache
def floors() -> tuple[Segments, ...]:
    return tuple(draw_floors(KIND, 6, np.random.default_rng(5)))


@cache
def seen_on(floor: int) -> Scan:
    ranges = scan(floors()[floor], TRUTH, SCANNER, np.random.default_rng(floor)).ranges
    return linefix.scan_of(ranges, (SCANNER.angle_min, SCANNER.angle_increment))


@cache
def building() -> MapSet:
    """Return the first five floors."""
    return map_set({f"floor-{k}": MapPart(one) for k, one in enumerate(floors()[:5])})


def is_truth(pose: RigidTransform | None) -> bool:
    return pose is not None and math.hypot(pose.x - TRUTH.x, pose.y - TRUTH.y) < 0.05


def test_the_floor_is_found_among_floors_that_share_their_outer_walls() -> None:
    right = 0
    for floor in range(5):
        found = associate_on_maps(building(), seen_on(floor))
        assert found.map_id == found.maps[0].map_id
        assert {one.map_id for one in found.maps} == set(building().ids)
        scores = [one.score for one in found.maps if one.score is not None]
        assert scores == sorted(scores, reverse=True)
        is_right = found.map_id == f"floor-{floor}" and is_truth(found.pose)
        assert is_right or not found.usable
        assert not found.usable or f"on the map {found.map_id}" in message_of(found)
        right += is_right and found.usable
    assert right >= 3


@pytest.mark.parametrize("floor", [0, 4])
def test_the_answer_is_that_of_the_map_alone_in_its_frame_and_indices(floor: int) -> None:
    far = np.array([500_000.0, -4_000_000.0])
    # A wall across the corridor that is gone since.
    gone = [[24.0, 8.8, 24.0, 10.2], [24.0, 10.2, 24.0, 8.8]]
    mapped = [Segments.from_array(np.vstack([one.endpoints, gone])) for one in floors()[:5]]
    maps = map_set({str(k): MapPart(one.shifted(k * far)) for k, one in enumerate(mapped)})
    alone = associate(MapIndex.build(mapped[floor].shifted(floor * far)), seen_on(floor))
    among = associate_on_maps(maps, seen_on(floor))
    assert among.pose is not None
    assert alone.pose is not None
    assert (among.pose.x, among.pose.y) == pytest.approx((alone.pose.x, alone.pose.y), rel=0.0, abs=1e-6)
    assert among.covariance is not None
    assert alone.covariance is not None
    np.testing.assert_allclose(among.covariance, alone.covariance, rtol=1e-6)
    assert [(a.scan, a.map) for a in among.correspondences] == [(a.scan, a.map) for a in alone.correspondences]
    assert among.missing_map == alone.missing_map
    assert {len(mapped[floor]) - 2, len(mapped[floor]) - 1} & set(among.missing_map)
    assert among.diagnostics is not None
    assert alone.diagnostics is not None
    before, own = among.diagnostics.registration.ambiguity_before, alone.diagnostics.registration.ambiguity_before
    assert before is not None
    assert own is not None
    assert before.translation == pytest.approx(own.translation, rel=1e-6)


def test_equal_floors_are_ambiguous_and_both_are_listed() -> None:
    maps = map_set({"a": MapPart(floors()[0]), "b": MapPart(floors()[0]), "c": MapPart(floors()[1])})
    found = associate_on_maps(maps, seen_on(0))
    assert not found.usable
    assert str(found.status) == "ambiguous"
    listed = {one.map_id: str(one.status) for one in found.maps}
    assert listed["a"] == listed["b"] == "ambiguous"
    assert all(is_truth(one.pose) for one in found.maps[:2])
    other = ({"a", "b"} - {found.map_id}).pop()
    assert found.alternatives[0].map_id == other
    (reason,) = [one for one in found.reasons if one.code == "similar_place"]
    assert f"the map {other}" in reason.message
    assert f"on the map {other}" in message_of(found)
    assert found.probability is not None
    assert found.probability <= 0.5


def test_a_floor_that_is_not_among_them_is_not_usable() -> None:
    without = map_set({str(k): MapPart(floors()[k]) for k in range(5)})
    assert not associate_on_maps(without, seen_on(5)).usable


def test_another_building_is_on_none_of_them() -> None:
    other = draw_floors(FLOOR_KINDS["flats"], 1, np.random.default_rng(8))[0]
    pose = RigidTransform(15.0, 7.0, 0.3)
    ranges = scan(other, pose, SCANNER, np.random.default_rng(1)).ranges
    found = associate_on_maps(building(), linefix.scan_of(ranges, (SCANNER.angle_min, SCANNER.angle_increment)))
    assert not found.usable


def test_weights_decide_between_equal_floors_and_are_not_fused() -> None:
    maps = map_set({"a": MapPart(floors()[0]), "b": MapPart(floors()[0])})
    plain = associate_on_maps(maps, seen_on(0))
    for name in ("a", "b"):
        found = associate_on_maps(maps, seen_on(0), KnownOfMaps(map_weights={name: 0.9999}))
        assert found.map_id == name
        assert found.pose is not None
        assert plain.pose is not None
        assert found.pose.x == pytest.approx(plain.pose.x, abs=1e-9)
        first, second = found.maps
        assert first.score is not None
        assert second.score is not None
        assert first.score - second.score == pytest.approx(math.log(0.9999 / 0.0001), abs=1e-6)


def test_weights_do_not_overrule_the_scan() -> None:
    found = associate_on_maps(building(), seen_on(0), KnownOfMaps(map_weights={"floor-3": 1.0}))
    assert not found.usable
    assert "prior_contradicted" in [one.code for one in found.reasons]


@pytest.mark.parametrize("hard", [True, False])
def test_a_prior_is_on_its_map(hard: bool) -> None:
    maps = map_set({"a": MapPart(floors()[0]), "b": MapPart(floors()[0])})
    prior = HardPrior(TRUTH, 1.0, 0.5) if hard else SoftPrior(TRUTH, np.diag([0.1, 0.1, 0.05]))
    for name in ("a", "b"):
        found = associate_on_maps(maps, seen_on(0), KnownOfMaps(prior, name))
        assert found.map_id == name
        assert is_truth(found.pose)


def test_prior_and_weights_name_a_map_that_is_searched() -> None:
    prior = HardPrior(TRUTH, 1.0, 0.5)
    for known, argument in [
        (KnownOfMaps(prior), "prior.map_id"),
        (KnownOfMaps(prior, "roof"), "prior.map_id"),
        (KnownOfMaps(map_weights={"roof": 0.5}), "map_weights.roof"),
        (KnownOfMaps(map_weights={"floor-1": 1.5}), "map_weights.floor-1"),
        (KnownOfMaps(map_weights={"floor-1": math.nan}), "map_weights.floor-1"),
        (KnownOfMaps(map_weights={"floor-1": 0.6, "floor-2": 0.6}), "map_weights"),
        (KnownOfMaps(map_weights=dict.fromkeys(building().ids, 0.0)), "map_weights"),
    ]:
        with pytest.raises(InvalidSearchError) as refused:
            associate_on_maps(building(), seen_on(0), known)
        assert refused.value.argument == argument


def test_maps_that_cannot_be_searched_are_named() -> None:
    room = MapPart(floors()[0])
    for maps, argument in [
        ([], "maps"),
        ([("a", room)] * 2, "maps"),
        ([("a", room), ("b", MapPart(Segments.from_array([])))], "maps.1.segments"),
        ([("a", room), ("b", replace(room, sigma=11.0))], "maps.1.sigma"),
        ([("a", MapPart(Segments.from_array(np.array([[0, 0, 1, 0], [2e5, 0, 2e5, 1]]))))], "maps.0.segments"),
        ([(str(k), room) for k in range(257)], "maps"),
    ]:
        with pytest.raises(InvalidMapError) as refused:
            map_set(maps)
        assert refused.value.argument == argument


def test_alternatives_are_in_the_frames_of_their_maps() -> None:
    found = associate_on_maps(building(), seen_on(0), options=AssociationOptions(max_alternatives=20))
    width, depth = KIND.size
    assert {one.map_id for one in found.alternatives} > {"floor-0"}
    assert all(-1.0 < one.pose.x < width + 1.0 and -1.0 < one.pose.y < depth + 1.0 for one in found.alternatives)


def test_a_map_without_directions_makes_all_undirected() -> None:
    first, second = (replace(MapPart(one), oriented=False) for one in floors()[:2])
    found = associate_on_maps(map_set({"a": first, "b": second, "c": MapPart(floors()[2])}), seen_on(2))
    assert found.map_id == "c"
    assert is_truth(found.pose)
    assert all(0 <= pair.map < len(floors()[2]) for pair in found.correspondences)


def test_a_scan_wider_than_the_maps_gets_wider_gaps() -> None:
    rows = [[0.0, 0.0, 400.0, 0.0], [400.0, 0.0, 400.0, 30.0]]
    wide = linefix.scan_of(Segments.from_array(rows))
    index = building().index_for(wide)
    assert index.gap >= gap_of(400.0) > building().index.gap
    assert associate_on_maps(building(), wide).pose is None


def test_parts_of_an_answer_are_left_out_as_of_one_map() -> None:
    found = associate_on_maps(building(), seen_on(0), options=AssociationOptions(parts=("alternatives",)))
    assert found.map_id == "floor-0"
    assert found.correspondences == ()
    assert found.missing_map == ()


def test_maps_lie_apart_in_the_joint_frame() -> None:
    rng = np.random.default_rng(0)
    boxes = np.zeros((40, 4))
    boxes[:, 2:] = rng.uniform(1.0, 300.0, (40, 2))
    centres = places_of(boxes, 100.0)
    low, high = centres - 0.5 * boxes[:, 2:], centres + 0.5 * boxes[:, 2:]
    apart = np.maximum(low[:, None] - high, low - high[:, None]).max(axis=2)
    assert apart[~np.eye(40, dtype=bool)].min() >= 99.0  # corners are rounded to metres
    assert (centres == np.round(centres)).all()
    assert np.abs(centres).max() < 3000.0


def test_area_and_directions_are_those_of_the_maps() -> None:
    one = MapIndex.build(floors()[0])
    turned = RigidTransform(0.0, 0.0, 0.6).apply(floors()[0].endpoints.reshape(-1, 2)).reshape(-1, 4)
    both = map_set({"a": MapPart(floors()[0]), "b": MapPart(Segments.from_array(turned))}).index
    same = map_set({"a": MapPart(floors()[0]), "b": MapPart(floors()[0])}).index
    assert isinstance(same, JointIndex)
    assert same.area == pytest.approx(2.0 * one.area, rel=0.01)
    assert same.agreeing_share() == pytest.approx(one.agreeing_share(), rel=1e-6)
    assert both.agreeing_share() == pytest.approx(one.agreeing_share(), rel=0.1)
    assert same.diagonal == pytest.approx(one.diagonal)


def test_the_least_exact_map_decides_the_gates() -> None:
    assert joint_sigma([None, None]) is None
    assert joint_sigma([0.01, 0.01]) == 0.01
    assert joint_sigma([0.01, 0.05]) == 0.05
    assert joint_sigma([None, 0.01]) is None
    assert joint_sigma([None, 0.05]) == 0.05


def test_a_deadline_that_passes_is_told() -> None:
    found = associate_on_maps(building(), seen_on(0), deadline=Deadline(time.monotonic()))
    assert not found.search.complete
    assert not found.usable
    assert "search_incomplete" in [one.code for one in found.reasons]
    assert {one.map_id for one in found.maps} == set(building().ids)


def test_views_of_a_drive_are_all_on_one_map() -> None:
    step = RigidTransform(-1.5, 0.2, 0.1)
    before = scan(floors()[4], TRUTH.compose(step), SCANNER, np.random.default_rng(9)).ranges
    laser = linefix.LaserScan(SCANNER.angle_min, SCANNER.angle_increment, before)
    views = [View(seen_on(4)), View(linefix.scan_of(laser), step, np.diag([1e-4, 1e-4, 1e-5]), 0)]
    found = associate_on_maps(building(), assemble(views))
    assert found.map_id == "floor-4"
    assert is_truth(found.pose)
    assert all(0 <= pair.map < len(floors()[4]) for pair in found.correspondences)
    assert {pair.scan for pair in found.correspondences} & set(range(len(seen_on(4).measured), 1000))
