"""Scans of several views: drives, two scanners, motion within a scan: ``python -m benchmarks views``."""

from __future__ import annotations

from ..table import Row, print_rows
from .buildings import drives_of_strangers, lookalike_drives
from .last_scans import drives_and_last_scans
from .logs import drives_in_logs, time_of_views
from .scanners import turning, two_scanners


def views(quick: int) -> list[Row]:
    """Print all tables, one in `quick` of everything, and return their rows."""
    rows: list[Row] = []
    for title, some in (
        ("Drives in logs", drives_in_logs),
        ("Drives and their last scans alone", drives_and_last_scans),
        ("Drives in other buildings", drives_of_strangers),
        ("Drives where places look alike", lookalike_drives),
        ("Two scanners", two_scanners),
        ("Motion within a scan", turning),
        ("Time", time_of_views),
    ):
        found = some(quick)
        print_rows(title, found)
        rows += found
    return rows
