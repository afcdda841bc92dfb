"""A virtual laser scanner and worlds to put it in: for experiments, benchmarks and the analysis of maps."""

from .errors import SimulationError
from .scanner import Scanner, SimulatedScan, scan

__all__ = ["Scanner", "SimulatedScan", "SimulationError", "scan"]
