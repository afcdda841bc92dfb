"""Conclusions from all sample scans: whether they fit better if a property of the map is changed."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from association.causes import Mistake
from association.units import unit_mistake
from registration import wrap_angle

from .result import Advice, Finding, SampleReport
from .samples import Sample, Way
from .tuning import (
    BETTER_SCORE,
    BETTER_USABLE,
    GREATEST_SIGMA,
    HIDDEN_SCALE,
    LEAST_SCALE,
    LEAST_SIGMA,
    LITTLE,
    MANY,
    MOVED_METRES,
    MOVED_RADIANS,
    SAME_FACTOR,
    WIDEST,
)


def judge_samples(samples: Sequence[Sample], *, sigma: float | None, oriented: bool) -> SampleReport:
    """Conclude from all samples together what would be better about their map.

    Parameters
    ----------
    samples : sequence of Sample
    sigma : float or None
        The map's.
    oriented : bool
        True when the map states that directions mean something.
    """
    present: Way = oriented, sigma
    if not samples:
        return SampleReport((), Advice(), 0, 0)
    directed = _best_directions(samples, present)
    off = _sigma_of(samples, directed)
    best = _nearest_way(samples, present, directed, off)
    usable, would_be = (sum(one.trials[way].usable for one in samples if way in one.trials) for way in (present, best))
    scale = _scaled(samples, least=LEAST_SCALE if directed else HIDDEN_SCALE)
    mistakes = [found for found in (_mirrored(samples, present), _reversed(samples), scale) if found is not None]
    # Offsets that come from a mistake are no measure of the walls.
    advice = Advice() if mistakes or off is None else Advice(off, directed)
    findings = [found for found in (*mistakes, _moved(samples)) if found is not None]
    # A reversed map fits either way round, too; and a map to another scale fits by chance, more so without directions.
    if directed != oriented and _reversed(samples) is None and (scale is None or would_be > usable):
        findings.insert(0, _undirected(len(samples), usable, would_be))
    return SampleReport(tuple(findings), advice, usable, usable if advice.oriented is None else would_be)


def _undirected(count: int, usable: int, would_be: int) -> Finding:
    return Finding(
        "undirected",
        f"The scans fit better if directions are ignored: {would_be} of {count} are usable instead of {usable}. "
        'Set "oriented": false.',
    )


def _best_directions(samples: Sequence[Sample], present: Way) -> bool:
    """Return whether directions should mean something: as now, unless the scans fit clearly better otherwise."""

    def worth(directed: bool) -> tuple[int, float]:
        ways = {way for one in samples for way in one.trials if way[0] == directed}
        usable = (sum(one.trials[way].usable for one in samples if way in one.trials) for way in ways)
        return max(usable, default=0), sum(one.trials[directed, WIDEST].score for one in both)

    both = [one for one in samples if {(True, WIDEST), (False, WIDEST)} <= one.trials.keys()]
    (usable, score), (usable_otherwise, score_otherwise) = worth(present[0]), worth(not present[0])
    clearly = max(1.0, BETTER_USABLE * len(samples))
    # A score without directions may well come from chance: then clearly fewer scans are usable, or none.
    better = usable_otherwise > usable + clearly or (
        score_otherwise > BETTER_SCORE * score and usable_otherwise >= max(1.0, usable - clearly)
    )
    return present[0] is not better


def _nearest_way(samples: Sequence[Sample], present: Way, directed: bool, off: float | None) -> Way:
    """Return the way tried whose sigma is nearest to how far walls are off; no sigma at all counts as `LITTLE`."""
    ways = [way for one in samples for way in one.trials if way[0] == directed]
    if off is None or not ways:
        return present
    return min(ways, key=lambda way: abs(math.log((way[1] or LITTLE) / off)))


def _mirrored(samples: Sequence[Sample], present: Way) -> Finding | None:
    both = [(one.trials[present], one.mirrored) for one in samples if one.mirrored is not None]
    score, usable = sum(a.score for a, _ in both), sum(a.usable for a, _ in both)
    # Scans of another building fit better one way or the other by chance: none of them is usable.
    if sum(b.score for _, b in both) <= BETTER_SCORE * score or sum(b.usable for _, b in both) < max(1, usable):
        return None
    count = sum(b.score > a.score for a, b in both)
    return Finding(
        "mirrored",
        f"{count} of {len(samples)} scans fit better with left and right exchanged. The y axis of the map may point "
        "down, or the laser may be mounted upside down. Negate every y of map or scans, and exchange begin and end.",
    )


def _reversed(samples: Sequence[Sample]) -> Finding | None:
    count = sum(Mistake.REVERSED in one.mistakes for one in samples)
    telling = sum(bool(one.mistakes) or one.result.usable for one in samples)
    if not count or count <= MANY * telling:
        return None
    return Finding(
        "reversed",
        f"{count} of {len(samples)} scans fit much better with begin and end of every segment exchanged. Free space "
        "must lie on the left of the segments of scan and map. Exchange begin and end in one of them.",
    )


def _scaled(samples: Sequence[Sample], least: float) -> Finding | None:
    """Return a finding if most scans fit better by one factor that is farther from one than `least`."""
    factors = np.array([one.factor for one in samples if one.factor is not None])
    telling = sum(one.factor is not None or one.result.usable for one in samples)
    if len(factors) < min(2, len(samples)):
        return None
    middle = float(np.median(factors))
    agreeing = int((np.abs(factors / middle - 1.0) < SAME_FACTOR).sum())
    if agreeing < min(2, len(samples)) or agreeing <= MANY * telling or abs(middle - 1.0) < least:
        return None
    unit = unit_mistake(middle)
    said = f" The map seems to be in {unit}." if unit is not None else ""
    return Finding(
        "scale",
        f"{agreeing} of {len(samples)} scans fit better at another scale: divide the map by {middle:.4g}, or multiply "
        f"the scans by this factor.{said}",
    )


def _moved(samples: Sequence[Sample]) -> Finding | None:
    moves = [one.moved for one in samples if one.moved is not None]
    if not moves:
        return None
    at = np.array([(one.x, one.y) for one in moves])
    # In a rotation the places far from the origin move most: agree about all three at the median.
    x, y = (float(value) for value in np.median(at, axis=0))
    turn = math.atan2(*(float(np.median([f(one.theta) for one in moves])) for f in (math.sin, math.cos)))
    same = sum(
        math.hypot(one.x - x, one.y - y) < 2.0 * MOVED_METRES and abs(wrap_angle(one.theta - turn)) < MOVED_RADIANS
        for one in moves
    )
    if same <= MANY * len(moves) or (math.hypot(x, y) < MOVED_METRES and abs(turn) < MOVED_RADIANS):
        return None
    return Finding(
        "moved",
        f"{same} of {len(moves)} scans have poses that differ from the given ones by the same transform: the map's "
        f"frame is theirs rotated by {math.degrees(turn):.3g} degrees and moved by ({x:.3g}, {y:.3g}) m. Correct the "
        "map's origin, or the poses.",
    )


def _sigma_of(samples: Sequence[Sample], directed: bool) -> float | None:
    """Return how far walls are off, metres: the root mean square over walls of the offsets in the scans.

    If the assumed sigma is small, walls that are off by more are left out, and poses give way to the rest. So the
    widest sigma that was tried is used.
    """
    seen: dict[int, list[float]] = {}
    for one in samples:
        trial = one.trials.get((directed, WIDEST))
        for wall, offset in trial.offsets.items() if trial is not None else ():
            seen.setdefault(wall, []).append(offset)
    if not seen:
        return None
    squares = [float(np.mean(np.square(offsets))) for offsets in seen.values()]
    return round(min(GREATEST_SIGMA, max(LEAST_SIGMA, math.sqrt(float(np.mean(squares))))), 3)
