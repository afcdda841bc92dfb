"""Linefix next to other solvers: ``python -m benchmarks peers``, with the packages of the group ``peers`` installed."""

from .report import peers, versions

__all__ = ["peers", "versions"]
