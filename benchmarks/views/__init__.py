"""Scans of several views: drives, two scanners, motion within a scan: ``python -m benchmarks views``."""

from .tables import views

__all__ = ["views"]
