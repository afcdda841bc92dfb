"""Conclusions from all sample scans: whether they fit better if a property of the map is changed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from association import AssociationResult, Deadline, MapIndex, Scan

from ..scale import Matched, agreed
from ..scale import fits as explains
from . import tuning
from .result import Advice, Finding, SampleReport
from .samples import Hypothesis, Mistake, Sample, score_of
from .scaling import Scale, find_scale, unit_mistake

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
    some = [(scan, one) for scan, one in tried if len(scan.measured)][:: -(-len(tried) // tuning.MOST_SCANS)]
    fits = _Fits([one for _, one in tried], Hypothesis(oriented, index.sigma))
    directed = fits.best_directions()
    mistakes, thicker = fits.mistakes(), None
    if some and not mistakes and not deadline.passed:
        scale = find_scale(index, some, deadline, oriented=oriented)
        mistakes = [*_scaled(scale, len(some), fits.usable(fits.present))]
    if not mistakes and not deadline.passed:
        thicker = _thickness(index, some, oriented=directed)
    advice, usable, would_be = fits.advice(directed, mistakes)
    if thicker is not None and directed:  # a bias, of which a standard deviation is no measure
        advice, would_be = replace(advice, sigma=None), fits.usable(replace(fits.present, oriented=True))
    findings = [*mistakes, *_moved(fits.samples), *_beyond_limits([scan for scan, _ in tried])]
    if directed is not oriented and not mistakes:
        message = f"The scans fit better if directions are ignored: {would_be} of {len(tried)} are usable instead of "
        findings.insert(0, Finding("undirected", f'{message}{usable}. Set "oriented": false.'))
    if thicker is not None:
        findings.insert(0, _thickness_finding(thicker, oriented=directed))
    return SampleReport(tuple(findings), advice, usable, usable if advice.oriented is None else would_be, thicker)


@dataclass(frozen=True, slots=True)
class _Fits:
    """Fit of all samples under each hypothesis; `present` is that of the map as it is."""

    samples: Sequence[Sample]
    present: Hypothesis

    def usable(self, one: Hypothesis) -> int:
        """Return the number of scans that are usable under a hypothesis."""
        return sum(sample.trials[one].usable for sample in self.samples if one in sample.trials)

    def both(self, one: Hypothesis, other: Hypothesis) -> list[tuple[AssociationResult, AssociationResult]]:
        """Return the trials of the samples that were tried under both of two hypotheses."""
        return [(s.trials[one], s.trials[other]) for s in self.samples if {one, other} <= s.trials.keys()]

    def is_better(self, sent: Hypothesis, other: Hypothesis, known: int, usable: int) -> bool:
        """Return whether scans fit clearly better under another hypothesis, by scores or by how many are usable."""
        both = self.both(sent, other)
        clearly = max(1.0, tuning.BETTER_USABLE * len(self.samples))
        if usable > known + min(clearly, len(self.samples) - 1):
            return True
        # Scores of scans of another building are better by chance: hardly any of these is usable, one way or the other.
        better = sum(score_of(one) for _, one in both) > tuning.BETTER_SCORE * sum(score_of(one) for one, _ in both)
        return better and max(usable, known) >= min(2, len(self.samples))

    def mistakes(self) -> list[Finding]:
        """Return what all scans were sent with and fit better without."""
        found = []
        for mistake, message in MISTAKES.items():
            undone, widest = replace(self.present, mistake=mistake), replace(self.present, sigma=tuning.WIDEST)
            usable = self.usable(self.present), self.usable(undone)
            if self.is_better(widest, replace(widest, mistake=mistake), *usable):
                both = self.both(self.present, undone)
                count = sum(score_of(one) > score_of(sent) or one.usable > sent.usable for sent, one in both)
                found.append(Finding(mistake, f"{count} of {len(self.samples)} scans {message}"))
        return found

    def best_directions(self) -> bool:
        """Return whether directions should mean something: as now, unless the scans fit clearly better otherwise."""
        now = self.present.oriented
        usable = (max((self.usable(way) for way in self.ways(one)), default=0) for one in (now, not now))
        return now is not self.is_better(Hypothesis(now, tuning.WIDEST), Hypothesis(not now, tuning.WIDEST), *usable)

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
        best = min(self.ways(directed), key=lambda way: abs(math.log((way.sigma or tuning.LITTLE) / off)))
        # Offsets that come from a mistake are no measure of the walls.
        return Advice() if mistakes else Advice(off, directed), usable, self.usable(best)

    def _offset_of_walls(self, directed: bool) -> float | None:
        """Return how far walls are off, metres: the root mean square over walls of the offsets in the scans.

        If the assumed sigma is small, walls that are off by more are left out, and poses give way to the rest. So the
        widest sigma that was tried is used.
        """
        seen: dict[int, list[float]] = {}
        for one in self.samples:
            trial = one.trials.get(Hypothesis(directed, tuning.WIDEST))
            offsets = {} if trial is None or not explains(trial) else {o.map: o.offset for o in trial.correspondences}
            for wall, offset in offsets.items():
                seen.setdefault(wall, []).append(offset)
        if not seen:
            return None
        squares = [float(np.mean(np.square(offsets))) for offsets in seen.values()]
        return round(min(tuning.GREATEST_SIGMA, max(tuning.LEAST_SIGMA, math.sqrt(float(np.mean(squares))))), 3)


def _thickness(index: MapIndex, tried: Sequence[tuple[Scan, Sample]], *, oriented: bool) -> float | None:
    """Return by how much the walls of a map are thicker than drawn, metres; None where most scans agree on none.

    Lines without directions are walls of no thickness. In each scan the distance by which all walls are nearer than
    drawn is half of the thickness that is missing.
    """
    wide = Hypothesis(oriented, tuning.THICKNESS_SIGMA)
    trials = [(scan, sample.trials[wide]) for scan, sample in tried if wide in sample.trials]
    found = [Matched.of(index.segments, scan, result) for scan, result in trials]
    offset = agreed([one for one in found if one is not None], tuning.LITTLE, "offset", 0.5 * tuning.SAME_THICKNESS)
    thicker = 2.0 * offset.value if oriented else max(0.0, 2.0 * offset.value)
    least = max(tuning.LEAST_THICKER, 2.0 * tuning.DEVIATIONS * offset.deviation)
    return round(thicker, 3) if offset.count > tuning.MANY * len(tried) and abs(thicker) >= least else None


def _thickness_finding(thicker: float, *, oriented: bool) -> Finding:
    """Describe walls that are thicker, or thinner, than they are drawn."""
    if not oriented:
        return Finding(
            "centre_lines",
            f"The scans fit better if each line is the centre line of a wall {thicker:.2f} m thick. Import the drawing "
            f"with drawn `centres` and thickness {thicker:.2f}.",
        )
    more, sign, depth, side = (
        ("thicker", "plus", "smaller", "left") if thicker > 0.0 else ("thinner", "minus", "greater", "right")
    )
    half = 50.0 * abs(thicker)
    return Finding(
        "thickness",
        f"The scans fit better if walls are {100.0 * abs(thicker):.0f} cm {more} than drawn. For a drawing that was "
        f"imported with `centres`, import it again with its thickness {sign} {abs(thicker):.2f} m. For a grid, "
        f"import it again with the log, which estimates its `surface`, or with a `surface` {half:.1f} cm {depth}; its "
        f"unit is cells. In any other map, move each segment by {half:.1f} cm to its {side}.",
    )


def _scaled(scale: Scale | None, count: int, usable: int) -> Iterator[Finding]:
    """Return a finding if most scans fit better by one factor."""
    if scale is None or scale.is_one or scale.usable < usable:
        return
    # Some scans of another building fit by chance at one scale, and are usable at none.
    if scale.agreeing < min(2, count) or scale.agreeing <= tuning.MANY * (scale.usable or count):
        return
    of_scans, size = scale.of_scans, 1.0 / scale.factor if scale.of_scans else scale.factor
    factor, unit = unit_mistake(size, "scans" if of_scans else "map")
    remedy = f"divide the {'lengths of the scans' if of_scans else 'map'} by {factor:.4g}"
    remedy += "" if of_scans else ", or multiply the scans by this factor"
    yield Finding("scale", f"{scale.agreeing} of {count} scans fit better at another scale: {remedy}.{unit}")


def _beyond_limits(scans: Sequence[Scan]) -> Iterator[Finding]:
    """Return a finding if most scans have no segments, all for one reason: their ranges are beyond the limits."""
    told = [one.message for scan in scans for one in scan.warnings if one.code == "no_segments"]
    if len(told) > tuning.MANY * len(scans):
        yield Finding("scale", f"{len(told)} of {len(scans)} scans have no segments, such as this one: {told[0]}")


def _moved(samples: Sequence[Sample]) -> Iterator[Finding]:
    moves = np.array([(one.moved.x, one.moved.y, one.moved.theta) for one in samples if one.moved is not None])
    if not len(moves):
        return
    # In a rotation the places far from the origin move most: agree about all three at the median.
    columns = np.column_stack([moves[:, :2], np.sin(moves[:, 2]), np.cos(moves[:, 2])])
    x, y, sine, cosine = np.median(columns, axis=0)
    turn = math.atan2(sine, cosine)
    turned = np.abs(np.remainder(moves[:, 2] - turn + np.pi, math.tau) - np.pi)
    agree = (np.hypot(moves[:, 0] - x, moves[:, 1] - y) < 2.0 * tuning.MOVED_METRES) & (turned < tuning.MOVED_RADIANS)
    is_moved = math.hypot(x, y) >= tuning.MOVED_METRES or abs(turn) >= tuning.MOVED_RADIANS
    if agree.sum() <= tuning.MANY * len(moves) or not is_moved:
        return
    x, y, sine, cosine = columns[agree].mean(axis=0)
    yield Finding(
        "moved",
        f"{agree.sum()} of {len(moves)} scans have poses that differ from the given ones by the same transform: the "
        f"map's frame is theirs rotated by {math.degrees(math.atan2(sine, cosine)):.3g} degrees and moved by ({x:.3g}, "
        f"{y:.3g}) m. Correct the map's origin, or the poses.",
    )
