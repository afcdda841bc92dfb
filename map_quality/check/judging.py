"""Conclusions from all sample scans: whether they fit better if a property of the map is changed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from association import Deadline, MapIndex, Scan
from registration import wrap_angle

from .result import Advice, Finding, SampleReport
from .samples import Hypothesis, Mistake, Sample, Trial
from .scaling import Scale, find_scale, unit_mistake
from .thickness import find_thickness, thickness_finding
from .tuning import (
    BETTER_SCORE,
    BETTER_USABLE,
    GREATEST_SIGMA,
    LEAST_SIGMA,
    LITTLE,
    MANY,
    MOST_SCANS,
    MOVED_METRES,
    MOVED_RADIANS,
    WIDEST,
)

MISTAKES: Mapping[Mistake, str] = {
    "mirrored": "fit better with left and right exchanged. The y axis of the map may point down, or the laser may be "
    "mounted upside down. Negate every y of map or scans, and exchange begin and end.",
    "reversed": "fit much better with begin and end of every segment exchanged. Free space must lie on the left of the "
    "segments of scan and map. Exchange begin and end in one of them.",
}


def conclude(
    index: MapIndex, scans: Sequence[Scan], samples: Sequence[Sample | None], deadline: Deadline, *, oriented: bool
) -> SampleReport:
    """Conclude from all samples together what would be better about their map, and how thick its walls are.

    Parameters
    ----------
    index : MapIndex
        Built with its directions, whatever they mean.
    scans : sequence of Scan
    samples : sequence of Sample or None
        Of each scan, as of `try_sample`; None where there was no time for it.
    deadline : Deadline
    oriented : bool
        True when the map states that directions mean something.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    tried = [(scan, one) for scan, one in zip(scans, samples, strict=True) if one is not None]
    if not tried:
        return SampleReport((), Advice(), 0, 0)
    some = [(scan, one) for scan, one in tried if len(scan.measured)][:: -(-len(tried) // MOST_SCANS)]
    some_scans, some_samples = [scan for scan, _ in some], [one for _, one in some]
    fits = _Fits([one for _, one in tried], Hypothesis(oriented, index.sigma))
    directed = fits.best_directions()
    mistakes, thicker = fits.mistakes(), None
    if some and not mistakes and not deadline.passed:
        scale = find_scale(index, some_scans, some_samples, deadline, oriented=oriented)
        mistakes = [*_scaled(scale, len(some), fits.usable(fits.present))]
    if not mistakes and not deadline.passed:
        thicker = find_thickness(index, some_scans, deadline, oriented=directed)
    advice, usable, would_be = fits.advice(directed, mistakes)
    findings = [*mistakes, *_moved(fits.samples)]
    if directed is not oriented and not mistakes:
        findings.insert(0, _undirected(len(tried), usable, would_be))
    if thicker is not None:
        findings.insert(0, thickness_finding(thicker, oriented=directed))
    return SampleReport(tuple(findings), advice, usable, usable if advice.oriented is None else would_be, thicker)


@dataclass(frozen=True, slots=True)
class _Fits:
    """Fit of all samples under each hypothesis; `present` is that of the map as it is."""

    samples: Sequence[Sample]
    present: Hypothesis

    def usable(self, one: Hypothesis) -> int:
        """Return the number of scans that are usable under a hypothesis."""
        return sum(sample.trials[one].usable for sample in self.samples if one in sample.trials)

    def both(self, one: Hypothesis, other: Hypothesis) -> list[tuple[Trial, Trial]]:
        """Return the trials of the samples that were tried under both of two hypotheses."""
        return [(s.trials[one], s.trials[other]) for s in self.samples if {one, other} <= s.trials.keys()]

    def is_better(self, sent: Hypothesis, other: Hypothesis, known: int, usable: int) -> bool:
        """Return whether scans fit clearly better under another hypothesis, by scores or by how many are usable."""
        both = self.both(sent, other)
        clearly = max(1.0, BETTER_USABLE * len(self.samples))
        if usable > known + min(clearly, len(self.samples) - 1):
            return True
        # Scores of scans of another building are better by chance: hardly any of these is usable, or clearly fewer.
        better = sum(one.score for _, one in both) > BETTER_SCORE * sum(one.score for one, _ in both)
        return better and usable >= max(min(2, len(self.samples)), known - clearly)

    def mistakes(self) -> list[Finding]:
        """Return what all scans were sent with and fit better without."""
        found = []
        for mistake, message in MISTAKES.items():
            undone, widest = replace(self.present, mistake=mistake), replace(self.present, sigma=WIDEST)
            usable = self.usable(self.present), self.usable(undone)
            if self.is_better(widest, replace(widest, mistake=mistake), *usable):
                both = self.both(self.present, undone)
                count = sum(one.score > sent.score or one.usable > sent.usable for sent, one in both)
                found.append(Finding(mistake, f"{count} of {len(self.samples)} scans {message}"))
        return found

    def best_directions(self) -> bool:
        """Return whether directions should mean something: as now, unless the scans fit clearly better otherwise."""
        now = self.present.oriented
        usable = (max((self.usable(way) for way in self.ways(one)), default=0) for one in (now, not now))
        return now is not self.is_better(Hypothesis(now, WIDEST), Hypothesis(not now, WIDEST), *usable)

    def ways(self, directed: bool) -> list[Hypothesis]:
        """Return the hypotheses about directions and sigma alone that any scan was tried with."""
        ways = dict.fromkeys(way for one in self.samples for way in one.trials)
        return [way for way in ways if way.oriented is directed and way.mistake is None]

    def advice(self, directed: bool, mistakes: Sequence[Finding]) -> tuple[Advice, int, int]:
        """Return the advised properties, and how many scans are usable as the map is, and as advised."""
        usable, off = self.usable(self.present), self._offset_of_walls(directed)
        if off is None or not self.ways(directed):
            return Advice(), usable, usable
        # No sigma at all counts as `LITTLE`.
        best = min(self.ways(directed), key=lambda way: abs(math.log((way.sigma or LITTLE) / off)))
        # Offsets that come from a mistake are no measure of the walls.
        return Advice() if mistakes else Advice(off, directed), usable, self.usable(best)

    def _offset_of_walls(self, directed: bool) -> float | None:
        """Return how far walls are off, metres: the root mean square over walls of the offsets in the scans.

        If the assumed sigma is small, walls that are off by more are left out, and poses give way to the rest. So the
        widest sigma that was tried is used.
        """
        seen: dict[int, list[float]] = {}
        for one in self.samples:
            trial = one.trials.get(Hypothesis(directed, WIDEST))
            for wall, offset in trial.offsets.items() if trial is not None else ():
                seen.setdefault(wall, []).append(offset)
        if not seen:
            return None
        squares = [float(np.mean(np.square(offsets))) for offsets in seen.values()]
        return round(min(GREATEST_SIGMA, max(LEAST_SIGMA, math.sqrt(float(np.mean(squares))))), 3)


def _undirected(count: int, usable: int, would_be: int) -> Finding:
    return Finding(
        "undirected",
        f"The scans fit better if directions are ignored: {would_be} of {count} are usable instead of {usable}. "
        'Set "oriented": false.',
    )


def _scaled(scale: Scale | None, count: int, usable: int) -> Iterator[Finding]:
    """Return a finding if most scans fit better by one factor."""
    if (
        scale is None
        or scale.is_one
        or scale.agreeing < min(2, count)
        or scale.agreeing <= MANY * scale.usable
        or scale.usable < usable
    ):
        return
    if scale.of_scans:
        factor, unit = unit_mistake(1.0 / scale.factor, "scans")
        remedy = f"divide the lengths of the scans by {factor:.4g}"
    else:
        factor, unit = unit_mistake(scale.factor, "map")
        remedy = f"divide the map by {factor:.4g}, or multiply the scans by this factor"
    yield Finding("scale", f"{scale.agreeing} of {count} scans fit better at another scale: {remedy}.{unit}")


def _moved(samples: Sequence[Sample]) -> Iterator[Finding]:
    moves = [one.moved for one in samples if one.moved is not None]
    if not moves:
        return
    at = np.array([(one.x, one.y) for one in moves])
    # In a rotation the places far from the origin move most: agree about all three at the median.
    x, y = (float(value) for value in np.median(at, axis=0))
    turn = math.atan2(*(float(np.median([f(one.theta) for one in moves])) for f in (math.sin, math.cos)))
    same = sum(
        math.hypot(one.x - x, one.y - y) < 2.0 * MOVED_METRES and abs(wrap_angle(one.theta - turn)) < MOVED_RADIANS
        for one in moves
    )
    if same <= MANY * len(moves) or (math.hypot(x, y) < MOVED_METRES and abs(turn) < MOVED_RADIANS):
        return
    yield Finding(
        "moved",
        f"{same} of {len(moves)} scans have poses that differ from the given ones by the same transform: the map's "
        f"frame is theirs rotated by {math.degrees(turn):.3g} degrees and moved by ({x:.3g}, {y:.3g}) m. Correct the "
        "map's origin, or the poses.",
    )
