"""Twins of the kernels that match a scan to the walls."""

from __future__ import annotations

import math

import numpy as np

from association.layout import MATCH, Integers
from association.tables import Place, Raster
from association.tuning import BRIDGING, NARROW_REACH, SECTORS
from registration import RigidTransform
from registration.layout import Floats, Record, Records

from .geometry import TURN, cell_of, direction, listed, normal, point, rotation, translation, wrap


def match_scan(
    scan: Records, pose: RigidTransform, covariance: Floats, place: Place, gates: Records
) -> tuple[Records, float]:
    """Match every segment without stopping early; also sum the gains by overlap."""
    matches = np.zeros(len(scan), MATCH)
    for segment, match in zip(scan, matches, strict=True):
        _match_segment(segment, pose, covariance, place, gates[0], match)
    return matches, float(scan["gain"] @ matches["overlap"])


def _match_segment(
    segment: Record, pose: RigidTransform, covariance: Floats, place: Place, gate: Record, match: Record
) -> None:
    """Look at all walls that are listed where the midpoint lies; the best is least in offset and in missing overlap."""
    turned = rotation(pose.theta) @ point(segment)
    middle, d = turned + translation(pose), rotation(pose.theta) @ direction(segment)
    n = TURN @ d
    g = np.array([*n, n @ TURN @ turned])  # how the offset changes with x, y and theta
    offset_gate = _gate(gate, "offset", segment["offset_variance"] + g @ covariance @ g)
    angle_gate = _gate(gate, "angle", segment["angle_variance"] + covariance[2, 2])
    match["wall"], least = -1, math.inf
    for w in listed(place.grid, middle):
        wall = place.walls[w]
        offset = float(normal(wall) @ middle - wall["offset"])
        if abs(offset) > offset_gate or direction(wall) @ d < 1.0 - 0.5 * angle_gate**2:
            continue
        overlap = min(1.0, covered(place.walls, wall, middle, segment["length"]) / segment["length"])
        cost = abs(offset) / offset_gate + 1.0 - overlap
        if overlap >= gate["least_overlap"] and cost < least:
            least = cost
            match["wall"], match["offset"], match["overlap"] = w, offset, overlap
            match["sine"] = n @ direction(wall)


def _gate(gate: Record, what: str, variance: float) -> float:
    return float(np.clip(gate["sigmas"] * math.sqrt(variance), gate[f"least_{what}"], gate[f"greatest_{what}"]))


def covered(walls: Records, wall: Record, middle: Floats, length: float) -> float:
    """Return how much of a segment lies on a wall, and if it is long on others of the run, less the gaps between."""
    half = 0.5 * length

    def span(one: Record) -> tuple[float, float]:
        along = direction(one) @ middle
        return one["begin"] - along, one["end"] - along

    begin, end = span(wall)
    total = min(end, half) - max(begin, -half)
    if length <= BRIDGING or total <= 0.0:
        return float(total)
    for neighbour, sign, edge in (("before", -1.0, -begin), ("after", 1.0, end)):
        w = int(wall[neighbour])
        while w >= 0:
            near, far = sorted(sign * x for x in span(walls[w]))
            if near >= half:
                break
            total += min(far, half) - near - (near - edge)
            edge, w = far, int(walls[w][neighbour])
    return float(total)


def gates_about(scan: Records, theta_var: float, pin: Floats, slip: float, gates: Records) -> tuple[Floats, Integers]:
    """Return the angle gates in sectors, a hundredth wider, and which bits of the raster the offset gates may go by."""
    spreads, shifts = [], []
    for segment in scan:
        spreads.append(_gate(gates[0], "angle", float(segment["angle_variance"]) + theta_var) * SECTORS / math.tau)
        lever = abs(float(direction(segment) @ (point(segment) - pin))) + 1.01 * slip * float(np.hypot(*pin))
        gate = _gate(gates[0], "offset", float(segment["offset_variance"]) + theta_var * lever**2)
        shifts.append(SECTORS if 1.01 * gate <= NARROW_REACH else 0)
    return 1.01 * np.array(spreads), np.array(shifts, np.int64)


def reachable(scan: Records, pose: RigidTransform, spreads: Floats, shifts: Integers, raster: Raster) -> float:
    """Sum the gains of the segments near whose midpoint a wall has their direction, up to their spread."""
    total = 0.0
    width = math.tau / SECTORS
    for segment, spread, shift in zip(scan, spreads, shifts.tolist(), strict=True):
        cell = cell_of(raster.shape, pose.apply(point(segment)))
        bits = 0 if cell is None else int(raster.bits[cell]) >> shift
        centres = [width * s - math.pi for s in range(SECTORS) if bits >> s & 1]
        angle = float(segment["angle"]) + pose.theta
        if any(abs(wrap(angle - centre)) <= (spread + 0.5) * width for centre in centres):
            total += segment["gain"]
    return total
