"""Thickness of walls, estimated from sample scans."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from association import AssociationOptions, Deadline, IndexingEndedError, MapIndex, Scan, associate

from ..scale import Matched, agreed
from .result import Finding
from .tuning import (
    CONFIDENCE,
    DEVIATIONS,
    LEAST_THICKER,
    LITTLE,
    MANY,
    MOST_SCANS,
    SAME_THICKNESS,
    THICKNESS_SIGMA,
)


def find_thickness(index: MapIndex, scans: Sequence[Scan], deadline: Deadline, *, oriented: bool) -> float | None:
    """Return by how much the walls of a map are thicker than drawn, metres.

    Lines without directions are walls of no thickness. Scans are searched with a wide sigma of the walls. In each the
    distance by which all walls are nearer than drawn is half of the thickness that is missing.

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
        None where most scans agree on none, or no time was left to see.
    """
    some = scans[:: -(-len(scans) // MOST_SCANS)] if scans else []
    options = AssociationOptions(max_alternatives=0, confidence=CONFIDENCE, oriented=oriented, on_map=1.0)
    try:
        place = replace(index if oriented else index.undirected_by(deadline), sigma=THICKNESS_SIGMA)
    except IndexingEndedError:
        return None
    results = ((scan, associate(place, scan, None, options, deadline)) for scan in some)
    found = [Matched.of(index.segments, scan, result) for scan, result in results]
    offset = agreed([one for one in found if one is not None], LITTLE, "offset", 0.5 * SAME_THICKNESS)
    thicker = 2.0 * offset.value if oriented else max(0.0, 2.0 * offset.value)
    if deadline.passed or offset.count <= MANY * len(some):
        return None
    return round(thicker, 3) if abs(thicker) >= max(LEAST_THICKER, 2.0 * DEVIATIONS * offset.deviation) else None


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
