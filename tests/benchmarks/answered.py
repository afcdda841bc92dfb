"""Answers for tests of the calibration."""

from __future__ import annotations

from typing import Any

from association.verdict.models import USUAL
from benchmarks.examples import DRAWN, DRAWN_STRANGERS, SEGMENTS, Example


def example(*, right: bool = False, stranger: bool = False, told: bool = False, **more: Any) -> Example:
    """Return a usual answer."""
    group = DRAWN_STRANGERS if stranger else DRAWN
    return Example(
        SEGMENTS, group, "clean", more.pop("fold", "world"), more.pop("features", USUAL), right,
        more.pop("degenerate", False), told=told, **more,
    )  # fmt: skip
