"""Values that are rejected, with the argument at fault."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from association import (
    MAX_VIEWS,
    AssociationError,
    HardPrior,
    InvalidMapError,
    InvalidSearchError,
    KnownOfMaps,
    MapPart,
    MapPoints,
    MapSet,
    SoftPrior,
    View,
    assemble,
    associate_on_maps,
)
from registration import Segments

from .scenes import ROOM, index_of, pose, scan_of, seen

Call = Callable[[], object]
SCAN = scan_of(seen(ROOM, pose(3.0, 2.5, 0.7))[0])
CIRCLE = View(SCAN, relative_to=2), View(SCAN, relative_to=1)
LOST = View(SCAN, covariance=np.diag([101.0, 1.0, 1.0]))
PART = MapPart(Segments.from_array(ROOM))
PRIOR = HardPrior(pose(3.0, 2.5, 0.7), 1.0, 0.5)
TWO_HUNDRED_KM = np.array([[0.0, 0.0, 1.0, 0.0], [2e5, 0.0, 2e5 + 1.0, 0.0]])
CORRELATED = np.array([[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
LOPSIDED = np.array([[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def soft(covariance: Any) -> Call:
    return lambda: SoftPrior(pose(), covariance)


def hard(radius: float, angle: float) -> Call:
    return lambda: HardPrior(pose(), radius, angle)


def views(*given: View) -> Call:
    return lambda: assemble(given)


def index(walls: Any, sigma: float = 0.0) -> Call:
    return lambda: index_of(walls, sigma)


def points(of: Any, sigma: float | None = None) -> Call:
    return lambda: MapPoints.of(of, sigma)


def maps(*given: tuple[str, MapPart]) -> Call:
    return lambda: MapSet(given)


def of_maps(prior: HardPrior | None = None, map_id: str | None = None, **weights: float) -> Call:
    """Search on two maps with a prior on one of them, or with weights."""
    both = MapSet({"a": PART, "b": PART})
    return lambda: associate_on_maps(both, SCAN, KnownOfMaps(prior, map_id, weights or None))


@pytest.mark.parametrize(
    ("error", "argument", "call"),
    [
        (InvalidSearchError, "prior.covariance", soft(np.zeros((3, 3)))),
        (InvalidSearchError, "prior.covariance", soft(np.diag([1.0, 1.0, -1.0]))),
        (InvalidSearchError, "prior.covariance", soft(np.full((3, 3), math.nan))),
        (InvalidSearchError, "prior.covariance", soft(np.eye(2))),
        (InvalidSearchError, "prior.covariance", soft(LOPSIDED)),
        (InvalidSearchError, "prior.covariance", soft(CORRELATED)),
        (InvalidSearchError, "prior.covariance", soft(np.diag([1e-13, 1.0, 1.0]))),
        (InvalidSearchError, "prior.covariance", soft(np.diag([1e13, 1.0, 1.0]))),
        (InvalidSearchError, "prior.radius", hard(0.0, 1.0)),
        (InvalidSearchError, "prior.radius", hard(1e7, 1.0)),
        (InvalidSearchError, "prior.radius", hard(math.nan, 1.0)),
        (InvalidSearchError, "prior.angle", hard(1.0, 0.0)),
        (InvalidSearchError, "prior.angle", hard(1.0, 5.0)),
        (InvalidSearchError, "scan.views.1.relative_to", views(View(SCAN), *CIRCLE)),
        (InvalidSearchError, "scan.views.0.relative_to", views(View(SCAN, relative_to=1))),
        (InvalidSearchError, "scan.views", views()),
        (InvalidSearchError, "scan.views", views(*[View(SCAN)] * (MAX_VIEWS + 1))),
        (InvalidSearchError, "scan.views.1.covariance", views(View(SCAN), LOST)),
        (InvalidSearchError, "prior.map_id", of_maps(PRIOR)),
        (InvalidSearchError, "prior.map_id", of_maps(PRIOR, "roof")),
        (InvalidSearchError, "map_weights.roof", of_maps(roof=0.5)),
        (InvalidSearchError, "map_weights.a", of_maps(a=1.5)),
        (InvalidSearchError, "map_weights.a", of_maps(a=math.nan)),
        (InvalidSearchError, "map_weights", of_maps(a=0.6, b=0.6)),
        (InvalidSearchError, "map_weights", of_maps(a=0.0, b=0.0)),
        (InvalidMapError, "map.segments", index(np.zeros((0, 4)))),
        (InvalidMapError, "map.segments", index(TWO_HUNDRED_KM)),
        (InvalidMapError, "map.sigma", index(ROOM, -1.0)),
        (InvalidMapError, "map.sigma", index(ROOM, 11.0)),
        (InvalidMapError, "map.sigma", index(ROOM, math.nan)),
        (InvalidMapError, "map.points", points([[1.0, 2.0, 3.0]])),
        (InvalidMapError, "map.points", points([1.0, 2.0])),
        (InvalidMapError, "map.points", points([[1.0, 2.0], [3.0]])),
        (InvalidMapError, "map.points", points([["a", "b"]])),
        (InvalidMapError, "map.points.1", points([[0.0, 0.0], [math.nan, 0.0]])),
        (InvalidMapError, "map.points", points(np.zeros((200_001, 2)))),
        (InvalidMapError, "map.points_sigma", points([[2.0, 2.5]], 0.0)),
        (InvalidMapError, "map.points_sigma", points([[2.0, 2.5]], 10.1)),
        (InvalidMapError, "map.points_sigma", points([[2.0, 2.5]], math.nan)),
        (InvalidMapError, "maps", maps()),
        (InvalidMapError, "maps", maps(("a", PART), ("a", PART))),
        (InvalidMapError, "maps", maps(*((str(k), PART) for k in range(257)))),
        (InvalidMapError, "maps.1.segments", maps(("a", PART), ("b", MapPart(Segments.from_array(np.zeros((0, 4))))))),
        (InvalidMapError, "maps.1.sigma", maps(("a", PART), ("b", replace(PART, sigma=11.0)))),
        (InvalidMapError, "maps.0.segments", maps(("a", MapPart(Segments.from_array(TWO_HUNDRED_KM))))),
    ],
)
def test_the_argument_at_fault_is_named(error: type[AssociationError], argument: str, call: Call) -> None:
    with pytest.raises(error) as caught:
        call()
    assert caught.value.argument == argument


@pytest.mark.parametrize("prior", [lambda at: HardPrior(at, 1.0, 0.1), lambda at: SoftPrior(at, np.eye(3))])
def test_the_pose_of_a_prior_is_a_transform(prior: Callable[[Any], object]) -> None:
    with pytest.raises(InvalidSearchError, match=r"expected a RigidTransform, found \(1, 2, 0\)"):
        prior((1, 2, 0))
