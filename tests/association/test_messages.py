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
    percent = 100 * min(result.probability, 0.9999)
    assert message_of(result) == f"The robot is at this pose with a probability of {percent:.2f} %."


@pytest.mark.parametrize(
    ("world", "said"), [(rectangle_room(), "1 other pose fits"), (square_room(), "3 other poses fit")]
)
def test_others_as_good(world: World, said: str) -> None:
    assert message_of(searched(world)) == f"{said} the scan about as well. The scan alone does not decide between them."


def test_a_free_direction() -> None:
    sentence = message_of(searched(corridor()))
    assert sentence in (
        "The position along the direction (1.00, 0.00) is unknown, and the heading may be reversed.",
        "The position along the direction (-1.00, 0.00) is unknown, and the heading may be reversed.",
    )


def test_nothing() -> None:
    assert message_of(searched(l_room(), NOTHING)) == "No pose on this map explains the scan."


def test_what_is_not_to_be_relied_on() -> None:
    room = l_room()
    result = searched(room)
    unsure = replace(result, usable=False, reasons=(), probability=0.62)
    assert (
        message_of(unsure) == "The most likely pose has a probability of 62.00 %, which is not reliable: see `reasons`."
    )
