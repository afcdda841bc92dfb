"""A virtual laser scanner: for the analysis, the check and the update of maps, and for programs."""

from .errors import SimulationError
from .scanner import Scanner, SimulatedScan, scan

__all__ = ["Scanner", "SimulatedScan", "SimulationError", "scan"]
