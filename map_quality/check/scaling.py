"""The factor between the lengths of a map and of its sample scans: a unit that was taken for another, or a wrong scale.

If most scans are usable, their correspondences show the factor. Otherwise the map is divided by each factor of a
ladder, and some scans are searched in it. The factor with the highest sum of scores is refined in the same way.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from association import (
    AssociationResult,
    Deadline,
    IndexingEndedError,
    InvalidMapError,
    MapIndex,
    Scan,
    associate,
    scaled,
)
from registration import Segments

from ..scale import Matched, agreed
from . import tuning
from .samples import OPTIONS, Sample, score_of

# Factor by which a map is too large if its lengths are of the first unit and are taken for the second.
LENGTHS = {"millimetres": 0.001, "centimetres": 0.01, "inches": 0.0254, "feet": 0.3048, "metres": 1.0}
TAKEN_FOR: Mapping[float, tuple[str, str]] = {
    length / small: (one, other) for (one, small), (other, length) in itertools.combinations(LENGTHS.items(), 2)
}
SAME_UNIT = 0.003  # of a factor; nearer to one of units it is that


@dataclass(frozen=True, slots=True)
class Scale:
    """The factor by which the lengths of a map are greater than those of its scans.

    Attributes
    ----------
    factor, deviation : float
        The factor and its standard deviation.
    agreeing : int
        Number of scans of which each alone has this factor.
    usable : int
        Number of scans that are usable when map and scans are to scale.
    of_scans : bool
        True if the scans, not the map, are of an unusual size.
    """

    factor: float
    deviation: float
    agreeing: int
    usable: int
    of_scans: bool = False

    @property
    def is_one(self) -> bool:
        """Return whether map and scans may be of one scale."""
        return abs(self.factor - 1.0) < max(tuning.LEAST_SCALE, tuning.DEVIATIONS * self.deviation)


@dataclass(frozen=True, slots=True)
class _Scaled:
    """A map and scans that are searched in it, to scale by a factor.

    Attributes
    ----------
    index : MapIndex
    scans : sequence of Scan
    factor : float
        By which the map was divided; or, where the scans are of an unusual size, the scans were multiplied.
    oriented : bool
    deadline : Deadline
    """

    index: MapIndex
    scans: Sequence[Scan]
    factor: float
    oriented: bool
    deadline: Deadline

    def by(self, factor: float) -> _Scaled | None:
        """Return them with another factor, these having none; None where the map cannot be indexed, or not in time."""
        if not self.is_usual:
            return replace(self, scans=[scaled(scan, factor) for scan in self.scans], factor=factor)
        segments = Segments.derived(self.index.segments.endpoints[: self.index.directed] / factor)
        points = replace(self.index.points, positions=self.index.points.positions / factor)
        with suppress(InvalidMapError, IndexingEndedError):
            index = MapIndex.build(
                segments, self.index.sigma, oriented=self.oriented, points=points, deadline=self.deadline
            )
            return replace(self, index=index, factor=factor)
        return None

    def search(self, *, lax: bool = False) -> list[AssociationResult]:
        """Search each scan; `lax` finds walls that are off by decimetres, by segments alone, in half of the time."""
        options = replace(OPTIONS, oriented=self.oriented, offset_tolerance=tuning.LAX_TOLERANCE if lax else None)
        scans = [Scan(one.measured, None if one.views else one.viewpoint) for one in self.scans] if lax else self.scans
        return [associate(self.index, scan, None, options, self.deadline) for scan in scans]

    def fit(self, results: Sequence[AssociationResult]) -> Scale:
        """Estimate the factor from the correspondences."""
        found = [Matched.of(self.index.segments, scan, one) for scan, one in zip(self.scans, results, strict=True)]
        matched, sigma = [one for one in found if one is not None], self.index.sigma
        off = agreed(matched, tuning.LITTLE if sigma is None else sigma, "scale", tuning.SAME_FACTOR)
        usable = sum(one.usable for one in results)
        return Scale(self.factor * (1.0 - off.value), self.factor * off.deviation, off.count, usable)

    @property
    def extent(self) -> float:
        """The usual extent of the scans, metres."""
        return float(np.median([np.hypot(*np.ptp(scan.measured.segments.midpoints, axis=0)) for scan in self.scans]))

    @property
    def is_usual(self) -> bool:
        """Return whether the scans are as large as scans are: then the map is put to scale, else they are."""
        return tuning.LEAST_EXTENT <= self.extent <= tuning.GREATEST_EXTENT

    def rungs(self) -> Iterator[float]:
        """Yield the factors that are tried: those after which the scans fit into the map, and robots drive about it."""
        for factor in (*tuning.LADDER, *TAKEN_FOR, *(1.0 / factor for factor in TAKEN_FOR)):
            of_map, of_scans = (1.0 / factor, 1.0) if self.is_usual else (1.0, factor)
            extent, diagonal = of_scans * self.extent, of_map * self.index.diagonal
            fits = tuning.LEAST_EXTENT <= extent <= tuning.EXCEEDING * diagonal
            if fits and tuning.SMALLEST <= diagonal <= tuning.LARGEST:
                yield factor


def find_scale(
    index: MapIndex, tried: Sequence[tuple[Scan, Sample]], deadline: Deadline, *, oriented: bool
) -> Scale | None:
    """Estimate the factor between a map and sample scans.

    Parameters
    ----------
    index : MapIndex
    tried : sequence of (Scan, Sample)
        Each scan, and its search in the map as it is.
    deadline : Deadline
        When it passes, no factor is found.
    oriented : bool
        True when the map states that directions mean something.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    scans, results = [scan for scan, _ in tried], [sample.result for _, sample in tried]
    sent = _Scaled(index, scans, 1.0, oriented, deadline)
    if sum(one.usable for one in results) > tuning.MANY * len(scans):
        first = sent.fit(results)
    else:
        rung = _best_rung(sent)
        if rung is None:
            return None
        first = rung.fit(rung.search(lax=True))
    place = None if first.is_one or deadline.passed else sent.by(first.factor)
    return None if place is None else replace(place.fit(place.search()), of_scans=not sent.is_usual)


def _best_rung(sent: _Scaled) -> _Scaled | None:
    """Return map and scans by the factor of the ladder at which some scans fit best; None where none fits."""
    few = replace(sent, scans=sorted(sent.scans, key=lambda scan: -len(scan.measured))[: tuning.MOST_ON_LADDER])
    if sent.index.directed > tuning.MOST_LINES or few.extent <= 0.0:
        return None
    best, most = None, 0.0
    for factor in few.rungs():
        if sent.deadline.passed:
            return None
        place = few.by(factor)
        score = 0.0 if place is None else sum(score_of(one) for one in place.search(lax=True))
        if score > most:
            best, most = factor, score
    return None if best is None else sent.by(best)


def unit_mistake(factor: float, of: str) -> tuple[float, str]:
    """Return the factor between two units that is near to one, and which was taken for which; or the same and "".

    Lengths of the map or the scans, `of`, are greater by this factor.
    """
    for known, (unit, other) in TAKEN_FOR.items():
        for exact, told in ((known, f"{unit} taken for {other}"), (1.0 / known, f"{other} taken for {unit}")):
            if abs(factor / exact - 1.0) < SAME_UNIT:
                return exact, f" The {of} seem{'' if of.endswith('s') else 's'} to be in {told}."
    return factor, ""
