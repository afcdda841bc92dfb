"""Scans of worlds that were not used for tuning, and out-of-map scans: ``python -m benchmarks worlds``."""

from .report import worlds

__all__ = ["worlds"]
