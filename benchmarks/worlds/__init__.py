"""Scans of worlds that nobody tuned on, and of strangers: ``python -m benchmarks worlds``."""

from .report import worlds

__all__ = ["worlds"]
