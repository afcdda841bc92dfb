"""Drawn buildings, rooms and floors, and scans of them with errors of known size: for tests, benchmarks and examples.

No part of the product: the wheel does not contain this package.
"""

from .cases import Case, Window, draw_case
from .conditions import CONDITIONS, Condition, Stranger
from .families import FAMILIES, Building, Family
from .floors import FLOOR_KINDS, FloorKind, draw_floors, free_places
from .offices import OfficePlan, offices
from .places import free_place
from .rooms import (
    World,
    corridor,
    cut_square,
    l_room,
    oblique,
    pillars,
    rectangle_room,
    square_room,
    with_obstacles,
)
from .walls import wall_of_segment

__all__ = [
    "CONDITIONS",
    "FAMILIES",
    "FLOOR_KINDS",
    "Building",
    "Case",
    "Condition",
    "Family",
    "FloorKind",
    "OfficePlan",
    "Stranger",
    "Window",
    "World",
    "corridor",
    "cut_square",
    "draw_case",
    "draw_floors",
    "free_place",
    "free_places",
    "l_room",
    "oblique",
    "offices",
    "pillars",
    "rectangle_room",
    "square_room",
    "wall_of_segment",
    "with_obstacles",
]
