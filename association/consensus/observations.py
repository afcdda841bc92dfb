"""The observations of a consensus set: scan lines on walls, as the estimator takes them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from registration.layout import Floats, Records
from registration.values import value

from ..context import SearchContext
from ..scan.scan import Views
from ..tuning import ROUGHNESS
from .tuning import LEAST_KNOWN_VARIANCE

Indices = NDArray[np.intp]


@value(frozen=True, slots=True)
class Observations:
    """Scan lines on walls, (n,) each; of several views each line as each view shows it.

    Attributes
    ----------
    row : int
        The scan line.
    wall : int
        Number of the wall among `walls`.
    normals : (n, 2) float64
        Left normal of the wall.
    offsets : float64
        Of the line under the scan line, metres.
    centroids, directions : (n, 2) float64
        In the scan frame.
    spreads, variances : float64
        Second moment of the points along the line; variance of its offset by the scan's sigma, m^2.
    times : float64
        When a line was seen, from -0.5 to 0.5 of the sweep of the laser; 0 of a scan whose order is not known.
    paces : float64
        How fast that changes along the line, 1/m.
    view : int
    walls : (m,)
        The walls of the map that are matched, each once, in the order of their ties.
    ties : (m,)
        Where in its group of linked walls each is, as of `Place.ties`.
    sensor : (2,)
        The sensor's place in the scan frame.
    views : Views or None
        If the poses of views are uncertain.
    """

    row: Indices
    wall: Indices
    normals: Floats
    offsets: Floats
    centroids: Floats
    directions: Floats
    spreads: Floats
    variances: Floats
    times: Floats
    paces: Floats
    view: Indices
    walls: Indices
    ties: Floats
    sensor: Floats
    views: Views | None

    def __len__(self) -> int:
        return len(self.row)

    @property
    def timed(self) -> bool:
        """Return whether it is known in which order lines were seen."""
        return bool(self.times.any())


def observations_of(context: SearchContext, matches: Records) -> Observations | None:
    """Return the observations of matches, (n,) of `MATCH`; None where nothing is matched."""
    views, rows = context.scan.views, context.lines.rows
    matched = matches["wall"] >= 0
    if views is not None and views.uncertain:
        seen = context.lines.sightings
        seen = seen[matched[seen["row"]]]
        row, view, variances = seen["row"], seen["sensor"], np.maximum(seen["variance"], LEAST_KNOWN_VARIANCE)
    else:
        row, views = np.flatnonzero(matched), None
        seen, view = rows[row], np.zeros(len(row), np.intp)
        variances = np.maximum(1.0 / seen["weight"] - ROUGHNESS**2, LEAST_KNOWN_VARIANCE)
    if not len(row):
        return None
    of_line = matches["wall"][row]
    walls = np.unique(of_line)
    walls = walls[np.lexsort((walls, context.index.ties[walls]))]
    place = np.zeros(int(walls.max()) + 1, np.intp)
    place[walls] = np.arange(len(walls))
    on = context.index.walls.rows[of_line]
    sensor = np.array(context.sensor)
    centroids = np.stack([seen["centroid_x"], seen["centroid_y"]], axis=1)
    directions = np.stack([seen["dx"], seen["dy"]], axis=1)
    times, paces = _times(context, centroids - sensor, directions)
    return Observations(
        row=row,
        wall=place[of_line],
        normals=np.stack([-on["dy"], on["dx"]], axis=1),
        offsets=on["offset"] + matches["shift"][row],
        centroids=centroids,
        directions=directions,
        spreads=seen["spread"],
        variances=variances,
        times=times,
        paces=paces,
        view=view,
        walls=walls,
        ties=context.index.ties[walls],
        sensor=sensor,
        views=views,
    )


def _times(context: SearchContext, away: Floats, directions: Floats) -> tuple[Floats, Floats]:
    """Return when lines were seen, by their bearings from the first beam on, and how that changes along them."""
    scan = context.scan
    nothing = np.zeros(len(away))
    if scan.beams is None or scan.views is not None or not scan.ordered or len(scan.beams.angles) < 2:
        return nothing, nothing
    first, last = float(scan.beams.angles[0]), float(scan.beams.angles[-1])
    sweep = last - first
    if scan.still or not abs(sweep) > 0.0:
        return nothing, nothing
    bearings = math.copysign(1.0, sweep) * (np.arctan2(away[:, 1], away[:, 0]) - first) % math.tau
    squares = np.maximum(1e-6, (away**2).sum(axis=1))
    turns = (away[:, 0] * directions[:, 1] - away[:, 1] * directions[:, 0]) / squares
    return bearings / abs(sweep) - 0.5, turns / sweep
