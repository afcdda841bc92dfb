"""Drawn worlds: buildings of many kinds, errors of their maps and lasers, and out-of-map scans.

Nothing here is part of the product. The same names and numbers draw the same to the bit.
"""

from .buildings import FAMILIES, Building, Family
from .cases import Case, Window, draw_case
from .conditions import CONDITIONS, Condition, Stranger
from .floors import FLOOR_KINDS, FloorKind, draw_floors, free_places
from .map_errors import wall_of_segment
from .places import free_place

__all__ = [
    "CONDITIONS",
    "FAMILIES",
    "FLOOR_KINDS",
    "Building",
    "Case",
    "Condition",
    "Family",
    "FloorKind",
    "Stranger",
    "Window",
    "draw_case",
    "draw_floors",
    "free_place",
    "free_places",
    "wall_of_segment",
]
