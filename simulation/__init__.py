"""A virtual laser scanner, and simple worlds to put it in: rooms with known answers and office floors."""

from .offices import OfficePlan, offices
from .scanner import Scanner, SimulatedScan, SimulationError, scan
from .worlds import (
    World,
    corridor,
    cut_square,
    l_room,
    oblique,
    outline,
    pillars,
    rectangle_room,
    square_room,
    with_obstacles,
)

__all__ = [
    "OfficePlan",
    "Scanner",
    "SimulatedScan",
    "SimulationError",
    "World",
    "corridor",
    "cut_square",
    "l_room",
    "oblique",
    "offices",
    "outline",
    "pillars",
    "rectangle_room",
    "scan",
    "square_room",
    "with_obstacles",
]
