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


def total_score(found: Sequence[Localized], of: Sequence[Localized]) -> float:
    """Return the score of the scans that were located before, nats."""
    return sum(one.score for one, before in zip(found, of, strict=True) if before.located)


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


def lost_scans(first: Sequence[Localized], found: Sequence[Localized]) -> Bools:
    """Return which scans were usable, and now fit the new map less and may not be used there, (n,).

    A scan that fits the new map better, and may not be used there, has met an honest doubt: a door is shut, say, and
    its room looks like others.
    """
    both = zip(first, found, strict=True)
    return np.array(
        [one.usable and not new.usable and new.score < one.score - tuning.LOWER_SCORE for one, new in both], dtype=bool
    )


def most_lost(count: int) -> float:
    """Return how many of so many scans a proposal may lose."""
    return max(1.0, tuning.FEWER_USABLE * count)


def keeps_usable(first: Sequence[Localized], found: Sequence[Localized]) -> bool:
    """Return whether a proposal loses hardly any scan."""
    return bool(lost_scans(first, found).sum() <= most_lost(len(first)))


def blamed(seen: Bools, most: float) -> list[int]:
    """Return changes without which few of the lost scans are left; the one that most of them see comes first.

    Parameters
    ----------
    seen : (k, n)
        True where a lost scan sees a change: k changes, n scans.
    most : float
        Number of lost scans that may be left.
    """
    found: list[int] = []
    left = np.ones(seen.shape[1], dtype=bool)
    while left.sum() > most:
        counts = seen[:, left].sum(axis=1)
        worst = int(np.argmax(counts))
        if counts[worst] == 0:
            break
        found.append(worst)
        left &= ~seen[worst]
    return found


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
