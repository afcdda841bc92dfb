"""The observations of a consensus set: scan lines on walls, as the estimator takes them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration.layout import Floats, Records, floats

from ..context import SearchContext
from ..layout import OBSERVATION
from ..scan.scan import Views
from ..tuning import ROUGHNESS
from .tuning import LEAST_KNOWN_VARIANCE

Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Observations:
    """Scan lines on walls, (n,) each; of several views each line as each view shows it.

    Attributes
    ----------
    lines : (n,) of `OBSERVATION`
    walls : (m,)
        The walls of the map that are matched, each once, in the order of their ties.
    ties, own : (m,)
        Place of each in its group of linked walls, as of `Place.ties`; how far it is one of its own next to the one
        before it, 0 to 1.
    sensor : (2,)
        The sensor's place in the scan frame.
    views : Views or None
        If the poses of views are uncertain.
    """

    lines: Records
    walls: Indices
    ties: Floats
    own: Floats
    sensor: Floats
    views: Views | None

    @property
    def timed(self) -> bool:
        """Return whether it is known in which order lines were seen."""
        return bool(self.lines["time"].any())


def observations_of(context: SearchContext, matches: Records) -> Observations | None:
    """Return the observations of matches, (n,) of `MATCH`; None where nothing is matched."""
    views, rows = context.scan.views, context.lines.rows
    matched = matches["wall"] >= 0
    if not matched.any():
        return None
    if views is not None and views.uncertain:
        seen = context.lines.sightings
        seen = seen[matched[seen["row"]]]
        row, view, variances = seen["row"], seen["sensor"], seen["variance"]
    else:
        row, view, views = np.flatnonzero(matched), 0, None
        seen = rows[row]
        variances = 1.0 / seen["weight"] - ROUGHNESS**2
    of_line, index = matches["wall"][row], context.index
    walls = np.unique(of_line)
    walls = walls[np.argsort(index.ties[walls], kind="stable")]
    ties, place = index.ties[walls], np.zeros(int(walls.max()) + 1, np.intp)
    place[walls] = np.arange(len(walls))
    on, lines = index.walls.rows[of_line], np.zeros(len(row), OBSERVATION)
    for name in ("centroid_x", "centroid_y", "dx", "dy", "spread"):
        lines[name] = seen[name]
    lines["normal_x"], lines["normal_y"], lines["offset"] = -on["dy"], on["dx"], on["offset"] + matches["shift"][row]
    lines["variance"], lines["wall"], lines["of_view"] = (
        np.maximum(variances, LEAST_KNOWN_VARIANCE),
        place[of_line],
        view,
    )
    _set_times(context, lines)
    own = np.ones(len(walls))
    after = np.flatnonzero((ties[1:] >= 0.0) & (ties[:-1] >= 0.0)) + 1
    own[after] = 1.0 - np.exp(2.0 * (ties[after - 1] - ties[after]))
    return Observations(lines, walls, ties, own, np.array(context.sensor), views)


def _set_times(context: SearchContext, lines: Records) -> None:
    """Set when lines were seen, by their bearings from the first beam on, and how that changes along them."""
    scan = context.scan
    if not scan.timed or scan.beams is None:
        return
    first, last = float(scan.beams.angles[0]), float(scan.beams.angles[-1])
    sweep = last - first
    if not abs(sweep) > 0.0:
        return
    x, y, dx, dy = floats(lines, "centroid_x", "centroid_y", "dx", "dy")
    x, y = x - context.sensor[0], y - context.sensor[1]
    bearings = math.copysign(1.0, sweep) * (np.arctan2(y, x) - first) % math.tau
    lines["time"] = bearings / abs(sweep) - scan.moment
    lines["pace"] = (x * dy - y * dx) / np.maximum(1e-6, x * x + y * y) / sweep
