"""Thickness of walls, estimated from sample scans."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from association import AssociationOptions, Deadline, IndexingEndedError, MapIndex, Scan, associate, mirrored
from registration import Segments

from .result import Finding
from .samples import Trial
from .tuning import (
    BETTER_THICKNESS,
    CONFIDENCE,
    LEAST_THICKER,
    MOST_LINES,
    MOST_SCANS,
    THICKER,
    THICKER_STEP,
    THICKNESS_SIGMA,
)

Scores = dict[float, float]
"""Of the scans together, nats, by how much thicker the walls were taken to be, metres."""


def find_thickness(index: MapIndex, scans: Sequence[Scan], deadline: Deadline, *, oriented: bool) -> float | None:
    """Return by how much the walls of a map are thicker than drawn, metres.

    Lines without directions are walls of no thickness. Some changes are tried with both faces of each wall, then those
    beside the best; between these the scores lie on a parabola.

    Parameters
    ----------
    index : MapIndex
        Built with its directions, whatever they mean.
    scans : sequence of Scan
        Taken there, in order; some of them, spread over all, are searched.
    deadline : Deadline
    oriented : bool
        True when the directions of the map mean something.

    Returns
    -------
    float or None
        None where nothing clearly fits better than the walls as they are, or no time was left to see.
    """
    scores = _scores(index, scans, deadline, oriented=oriented)
    if not scores:
        return None
    found = _top(scores)
    better = scores[_best(scores)] > BETTER_THICKNESS * scores[0.0]
    return round(found, 3) if better and abs(found) >= LEAST_THICKER else None


def _scores(index: MapIndex, scans: Sequence[Scan], deadline: Deadline, *, oriented: bool) -> Scores:
    """Return scores of possible thicknesses and of those next to the best; empty without scans to try, or time."""
    if not scans or index.directed > MOST_LINES:
        return {}
    some, faces = scans[:: -(-len(scans) // MOST_SCANS)], _faces(index, oriented=oriented)
    scores: Scores = {}

    def tried(changes: Sequence[float]) -> bool:
        for change in changes:
            if deadline.passed:
                return False
            try:
                scores[change] = _score(faces.moved_left(0.5 * change), some, deadline)
            except IndexingEndedError:
                return False
        return not deadline.passed

    first = [one for one in THICKER if oriented or one >= 0.0]
    return scores if tried(first) and tried(_beside(_best(scores))) else {}


def fit_better_mirrored(index: MapIndex, scans: Sequence[Scan], deadline: Deadline) -> bool:
    """Return whether scans fit a directed map better mirrored, each with the thickness of walls that fits best."""
    either = [_scores(index, some, deadline, oriented=True) for some in (scans, [mirrored(scan) for scan in scans])]
    as_they_are, other = (max(one.values(), default=0.0) for one in either)
    return other > as_they_are


def _faces(index: MapIndex, *, oriented: bool) -> Segments:
    lines = index.segments.take(np.arange(index.directed))
    return lines if oriented else Segments.derived(np.vstack([lines.endpoints, lines.reversed().endpoints]))


def thickness_finding(thicker: float, *, oriented: bool) -> Finding:
    """Describe walls that are thicker, or thinner, than they are drawn."""
    if not oriented:
        return Finding(
            "centre_lines",
            f"The scans fit better if each line is the centre line of a wall {thicker:.2f} m thick. Import the drawing "
            f"with drawn `centres` and thickness {thicker:.2f}.",
        )
    more, sign = ("thicker", "plus") if thicker > 0.0 else ("thinner", "minus")
    return Finding(
        "thickness",
        f"The scans fit better if walls are {100.0 * abs(thicker):.0f} cm {more} than drawn. For a drawing that was "
        f"imported with `centres`, import it again with its thickness {sign} {abs(thicker):.2f} m. For any other map, "
        "for example a grid, state this uncertainty as `sigma`.",
    )


def _score(faces: Segments, scans: Sequence[Scan], deadline: Deadline) -> float:
    index = MapIndex.build(faces, THICKNESS_SIGMA, deadline=deadline)
    options = AssociationOptions(max_alternatives=0, confidence=CONFIDENCE)
    return sum(Trial.of(associate(index, scan, None, options, deadline)).score for scan in scans)


def _best(scores: Scores) -> float:
    return max(scores, key=lambda one: scores[one])


def _beside(change: float) -> tuple[float, float]:
    """Return the changes that are one step smaller and larger; rounded, as keys."""
    return round(change - THICKER_STEP, 3), round(change + THICKER_STEP, 3)


def _top(scores: Scores) -> float:
    """Return the vertex of the parabola through the best score and those a step next to it."""
    best = _best(scores)
    low, high = _beside(best)
    if low not in scores or high not in scores:
        return best
    below, above = scores[low], scores[high]
    bend = below - 2.0 * scores[best] + above
    return best if bend >= 0.0 else best + THICKER_STEP * 0.5 * (below - above) / bend
