"""Scans on the old and on the new map: whether a proposal makes anything worse."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from . import tuning
from .evidence import WallEvidence
from .result import NOT_SHARPENED, Bools, Change, KeptCode, KeptWalls, Sharpened, Usable
from .scans import Localized

KEPT: dict[KeptCode, str] = {
    "still_seen": "beams pass through a part of the wall, and beams of a visit end on a part of it",
    "little_passed": "beams pass through too little of the wall, or on too few visits or from too few places",
    "worse_without": "beams pass through, but without the wall scans fit less, move, or are not usable",
}


@dataclass(frozen=True, slots=True, eq=False)
class Proposed:
    """Verified changes.

    Attributes
    ----------
    changes : tuple of Change
    found : tuple of Localized
        All scans, searched on the new map; empty where nothing has changed.
    sharpened : Sharpened
    kept : tuple of KeptWalls
    """

    changes: tuple[Change, ...] = ()
    found: tuple[Localized, ...] = ()
    sharpened: Sharpened = NOT_SHARPENED
    kept: tuple[KeptWalls, ...] = ()


def is_better(saw: Bools, first: Sequence[Localized], found: Sequence[Localized]) -> bool:
    """Return whether a change leaves the poses of the scans that saw it, (n,), and does not lower their score."""
    gain = 0.0
    for k in np.flatnonzero(saw).tolist():
        before, after = first[k], found[k]
        if not before.located:
            continue
        gain += after.score - before.score
        if after.located and math.hypot(after.pose.x - before.pose.x, after.pose.y - before.pose.y) > tuning.SAME_POSE:
            return False
    return gain >= -tuning.LOWER_SCORE


def keeps_usable(first: Sequence[Localized], found: Sequence[Localized]) -> bool:
    """Return whether hardly any usable scan fits the new map less, and may not be used there.

    A scan that fits the new map better, and may not be used there, has met an honest doubt: a door is shut, say, and
    its room looks like others.
    """
    both = [(one, new) for one, new in zip(first, found, strict=True) if one.usable and not new.usable]
    lost = sum(new.score < one.score - tuning.LOWER_SCORE for one, new in both)
    return lost <= max(1.0, tuning.FEWER_USABLE * len(first))


def kept_walls(evidence: WallEvidence, known: int, drafted: set[int], changed: set[int]) -> Iterator[KeptWalls]:
    """Yield the first `known` walls that several visits pass through and that no change names, by the reason.

    `drafted` are those for which a change was verified, `changed` those of the changes that are left.
    """
    found: dict[KeptCode, list[int]] = {}
    for wall in evidence.passed_walls().tolist():
        if wall < known and wall not in changed:
            own = np.arange(evidence.chunks.first[wall], evidence.chunks.first[wall + 1])
            read = evidence.is_read(evidence.rows_of(own))
            code: KeptCode = "worse_without" if wall in drafted else "still_seen" if read else "little_passed"
            found.setdefault(code, []).append(wall)
    for code, message in KEPT.items():
        if code in found:
            yield KeptWalls(code, message, tuple(found[code]))


def usable_of(first: Sequence[Localized], found: Sequence[Localized], *, held: bool) -> Usable:
    """Count the scans that are held back, or the others."""
    chosen = [(one.usable, after.usable) for one, after in zip(first, found, strict=True) if one.held_back == held]
    return Usable(len(chosen), sum(before for before, _ in chosen), sum(after for _, after in chosen))
