"""A virtual laser scanner and worlds to put it in: for experiments, benchmarks and the analysis of maps."""

from .buildings import FAMILIES, Building, Family
from .cases import Case, Window, draw_case
from .conditions import CONDITIONS, Condition, Stranger
from .errors import SimulationError
from .floors import FLOOR_KINDS, FloorKind, draw_floors, free_places
from .offices import OfficePlan, offices
from .places import free_place
from .scanner import Scanner, SimulatedScan, scan
from .walls import wall_of_segment
from .worlds import (
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
    "Scanner",
    "SimulatedScan",
    "SimulationError",
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
    "scan",
    "square_room",
    "wall_of_segment",
    "with_obstacles",
]
