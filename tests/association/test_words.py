"""Verdicts in words."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from association import AssociationResult, MapIndex, Scan, associate, message_of
from registration import MeasuredSegments, RigidTransform, Segments
from simulation import World, corridor, l_room, rectangle_room, square_room

NOTHING = Segments.from_array(np.zeros((0, 4)))


def searched(world: World, seen: Segments | None = None) -> AssociationResult:
    pose = RigidTransform(0.3, 0.2, 0.4)
    if seen is None:
        corners = pose.inverse().apply(world.segments.endpoints.reshape(-1, 2))
        seen = Segments.from_array(corners.reshape(-1, 4))
    scan = Scan(MeasuredSegments.from_segments(seen), None)
    return associate(MapIndex.build(world.segments, 0.0), scan)


def test_one_place() -> None:
    result = searched(l_room())
    assert result.probability is not None
    assert message_of(result) == f"The robot is here, with a chance of {100 * min(result.probability, 0.9999):.2f} %."


@pytest.mark.parametrize(
    ("world", "said"), [(rectangle_room(), "1 other place explains"), (square_room(), "3 other places explain")]
)
def test_others_as_good(world: World, said: str) -> None:
    assert message_of(searched(world)) == f"{said} the scan about as well: the robot cannot know which is right."


def test_a_free_direction() -> None:
    sentence = message_of(searched(corridor()))
    assert sentence in (
        "It cannot be told where along (1.00, 0.00) the robot is, nor which way round.",
        "It cannot be told where along (-1.00, 0.00) the robot is, nor which way round.",
    )


def test_nothing() -> None:
    assert message_of(searched(l_room(), NOTHING)) == "Nothing on this map explains the scan."


def test_what_is_not_to_be_relied_on() -> None:
    room = l_room()
    result = searched(room)
    unsure = replace(result, usable=False, reasons=(), probability=0.62)
    assert message_of(unsure) == (
        "Most likely the robot is here, with a chance of 62.00 %, but that is not to be relied on."
    )
