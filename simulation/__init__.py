"""A virtual laser scanner and worlds to put it in: for experiments, benchmarks and the analysis of maps."""

from .errors import SimulationError
from .offices import OfficePlan, offices
from .scanner import Scanner, SimulatedScan, scan
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
    "pillars",
    "rectangle_room",
    "scan",
    "square_room",
    "with_obstacles",
]
