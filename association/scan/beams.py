"""The beams of a scan: those of its ranges, or of segments the rays to what was seen and to where nothing was."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import Beams as Ranges
from registration.layout import Floats, Records

from ..layout import BEAM
from ..tuning import FAR, FARTHER, MAX_RAYS, MOST_BEAMS, RAY_SPACING
from .tuning import END_MARGIN, PROBE

Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class BeamSet:
    """Beams from known places.

    Attributes
    ----------
    rows : (m,) of `BEAM`
        In the scan frame; the range is inf where nothing was seen.
    line : (m,)
        The scan line that a ray goes to; -1 of a laser's beam, and where nothing was seen.
    sensor : (m,)
        Number of the view.
    weights : (m,)
        Less than 1 where several views are from one place.
    reach : float
        Range of a beam, metres.
    """

    rows: Records
    line: Indices
    sensor: Indices
    weights: Floats
    reach: float

    def __len__(self) -> int:
        return len(self.rows)

    def take(self, places: Indices) -> BeamSet:
        """Return some of the beams."""
        return BeamSet(self.rows[places], self.line[places], self.sensor[places], self.weights[places], self.reach)


def beams_of_ranges(ranges: Ranges, viewpoint: tuple[float, float], views: Indices | None, weights: Floats) -> BeamSet:
    """Return at most `MOST_BEAMS` of the beams of which something is known, evenly spread."""
    known = np.flatnonzero(~np.isnan(ranges.ranges))
    chosen = known[:: max(1, math.ceil(len(known) / MOST_BEAMS))]
    begins = np.broadcast_to(viewpoint, (len(chosen), 2)) if ranges.origins is None else ranges.origins[chosen]
    angles = ranges.angles[chosen]
    sensor = np.zeros(len(chosen), np.intp) if views is None else views[chosen]
    rows = _rows(begins, np.stack([np.cos(angles), np.sin(angles)], axis=1), ranges.ranges[chosen])
    return BeamSet(rows, np.full(len(chosen), -1), sensor, weights[sensor], ranges.range_max)


def rays_to_lines(seen: Records, viewpoints: Floats, weights: Floats) -> BeamSet:
    """Return rays to evenly spread points of what each view shows, (k,) of `SIGHTING`; none of views without place."""
    seen, ends = _points_on(seen[~np.isnan(viewpoints[seen["sensor"], 0])])
    return _rays_between(seen, viewpoints[seen["sensor"]], ends, weights[seen["sensor"]])


def probes(seen: Records) -> tuple[BeamSet, BeamSet]:
    """Return short rays to the same points, from the left of each segment and from the right."""
    seen, ends = _points_on(seen)
    across, weights = PROBE * np.stack([-seen["dy"], seen["dx"]], axis=1), np.ones(len(seen))
    return _rays_between(seen, ends + across, ends, weights), _rays_between(seen, ends - across, ends, weights)


def _points_on(seen: Records) -> tuple[Records, Floats]:
    """Return points of segments, with the segment of each, away from the ends, where its neighbours are."""
    counts = np.clip(np.ceil(seen["length"] / RAY_SPACING), 1, MAX_RAYS).astype(np.intp)
    of = np.repeat(np.arange(len(seen)), counts)
    number = np.arange(len(of)) - np.repeat(np.cumsum(counts) - counts, counts)
    one = seen[of]
    along = ((number + 0.5) / counts[of] - 0.5) * np.maximum(0.0, one["length"] - 2.0 * END_MARGIN)
    return one, np.stack([one["x"] + along * one["dx"], one["y"] + along * one["dy"]], axis=1)


def _rays_between(seen: Records, begins: Floats, ends: Floats, weights: Floats) -> BeamSet:
    way = ends - begins
    ranges = np.hypot(way[:, 0], way[:, 1])
    rows = _rows(begins, way / np.maximum(ranges, 1e-12)[:, None], ranges)
    farthest = float((ranges + 0.5 * seen["length"]).max(initial=0.0))
    line, sensor = np.ascontiguousarray(seen["row"]), np.ascontiguousarray(seen["sensor"])
    return BeamSet(rows, line, sensor, weights, max(FAR, FARTHER * farthest))


def together(one: BeamSet, other: BeamSet) -> BeamSet:
    """Return the beams of two sets."""
    rows = np.empty(len(one) + len(other), BEAM)
    rows[: len(one)], rows[len(one) :] = one.rows, other.rows
    line, sensor = np.concatenate([one.line, other.line]), np.concatenate([one.sensor, other.sensor])
    weights = np.concatenate([one.weights, other.weights])
    return BeamSet(rows, line, sensor, weights, max(one.reach, other.reach))


def _rows(begins: Floats, directions: Floats, ranges: Floats) -> Records:
    rows = np.empty(len(ranges), BEAM)
    rows["x"], rows["y"], rows["dx"], rows["dy"] = *begins.T, *directions.T
    rows["range"] = ranges
    return rows
