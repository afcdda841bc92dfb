"""The result of scans of one view or several, and their rows."""

from __future__ import annotations

import time
from dataclasses import dataclass

from association import MapIndex, Scan, associate
from registration import RigidTransform

from ..outcomes import OPTIONS, offset
from ..table import Row, at_least, at_most, mean

NEAR, TURNED = 0.3, 3.0  # m and degrees; farther off is wrong


@dataclass(frozen=True, slots=True)
class Trial:
    """The result of a scan.

    Attributes
    ----------
    usable, right : bool
    ms : float
        Processor time, milliseconds.
    pose : RigidTransform or None
        The answer.
    """

    usable: bool
    right: bool
    ms: float
    pose: RigidTransform | None


def is_near(pose: RigidTransform | None, truth: RigidTransform | None, near: float, turned: float) -> bool:
    """Tell whether a pose is less than `near` metres and `turned` degrees off."""
    if pose is None or truth is None:
        return False
    distance, angle = offset(pose, truth)
    return distance < near and angle < turned


def tried(index: MapIndex, asked: Scan, truth: RigidTransform | None, near: float, turned: float) -> Trial:
    start = time.thread_time()
    result = associate(index, asked, None, OPTIONS)
    took = 1e3 * (time.thread_time() - start)
    return Trial(result.usable, is_near(result.pose, truth, near, turned), took, result.pose)


def usable_share(what: str, trials: list[Trial], goal: float | None = None) -> Row:
    return at_least(f"{what}: usable of {len(trials)}", mean(t.usable for t in trials), goal)


def wrong_share(trials: list[Trial]) -> Row:
    usable = [t for t in trials if t.usable]
    wrong = sum(not t.right for t in usable)
    return at_most(f"  usable but wrong, % ({wrong} of {len(usable)})", 100.0 * wrong / max(1, len(usable)), 0.1)
