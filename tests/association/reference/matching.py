"""Twins of the kernels that match a scan to the walls."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from association.consensus.tuning import FLAT_GATE, FLAT_STEP, LONG_BRIDGE, OVERLAP_TAPER, SHORT_BRIDGE
from association.layout import MATCH, Integers
from association.tables import Place, Raster
from association.tuning import APART_GAP, APART_STEP, NARROW_REACH, SECTORS, WHOLE_GAP
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
    return matches, float(matches["gain"].sum())


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
        under = Under.of(place.walls, w, middle, d, float(segment["length"]), offset_gate)
        if under is None:
            continue
        overlap = min(1.0, under.covered / segment["length"])
        cost = abs(offset - under.shift) / offset_gate + 1.0 - overlap
        if overlap >= gate["least_overlap"] and cost < least:
            least, sine = cost, float(n @ direction(wall))
            match["wall"], match["offset"], match["overlap"] = w, offset - under.shift, overlap
            match["sine"], match["shift"], match["uneven"] = sine, under.shift, under.uneven
            taper = min(OVERLAP_TAPER, 1.0 - gate["least_overlap"])
            match["gain"] = segment["gain"] * overlap * min(1.0, (overlap - gate["least_overlap"]) / taper)
            match["gain"] *= fade(abs(offset) / offset_gate, FLAT_GATE, 1.0)
            match["gain"] *= fade(abs(sine) / angle_gate, FLAT_GATE, 1.0)


def fade(value: float, whole: float, apart: float) -> float:
    """Return Tukey's biweight of what is beyond `whole`."""
    beyond = min(1.0, max(0.0, value - whole) / (apart - whole))
    return float((1.0 - beyond**2) ** 2)


def _gate(gate: Record, what: str, variance: float) -> float:
    return float(np.clip(gate["sigmas"] * math.sqrt(variance), gate[f"least_{what}"], gate[f"greatest_{what}"]))


@dataclass(frozen=True)
class Under:
    """What lies under a segment on a wall and its chain: what counts as covered, and where the line of these is."""

    covered: float
    shift: float
    uneven: float

    @classmethod
    def of(cls, walls: Records, w: int, middle: Floats, d: Floats, length: float, gate: float) -> Under | None:
        """Follow the chain both ways; None where nothing of the segment is on the wall itself."""
        half, wall = 0.5 * length, walls[w]
        begin, end = _span(wall, middle)
        own = min(end, half) - max(begin, -half)
        if own <= 0.0:
            return None
        covered, parts = own, [(own, 0.0)]
        for sign, edge in ((-1.0, -begin), (1.0, end)):
            more, there = _followed(walls, w, middle, d, length, gate, sign, edge)
            covered += more
            parts += there
        weights, besides = np.array(parts).T
        shift = float(np.average(besides, weights=weights))
        return cls(float(covered), shift, float(np.average((besides - shift) ** 2, weights=weights)))


def _span(wall: Record, middle: Floats) -> tuple[float, float]:
    along = direction(wall) @ middle
    return float(wall["begin"] - along), float(wall["end"] - along)


def _followed(
    walls: Records, w: int, middle: Floats, d: Floats, length: float, gate: float, sign: float, reach: float
) -> tuple[float, list[tuple[float, float]]]:
    """Return by how much more is covered that way, as far as it is to the good, and the parts with their offset."""
    half, counts, net = 0.5 * length, 1.0, 0.0
    parts: list[tuple[float, float]] = []
    best: tuple[float, list[tuple[float, float]]] = 0.0, []
    bridges = float(np.clip((length - SHORT_BRIDGE) / (LONG_BRIDGE - SHORT_BRIDGE), 0.0, 1.0))
    v = int(walls[w]["after" if sign > 0.0 else "before"])
    while v >= 0 and reach < half:
        near, far = sorted(sign * x for x in _span(walls[v], middle))
        if near >= half:
            break
        if near > reach:
            whole = fade(near - reach, WHOLE_GAP, APART_GAP)
            counts *= whole + (1.0 - whole) * bridges
            net += counts * (near - reach) * (2.0 * whole - 1.0)
        low, high = max(near, reach), min(far, half)
        if high > low:
            at = middle + sign * 0.5 * (low + high) * d
            off, own = (float(normal(walls[k]) @ at - walls[k]["offset"]) for k in (v, w))
            part = counts * (high - low) * fade(abs(off) / gate, FLAT_GATE, 1.0)
            part *= fade(abs(own - off), FLAT_STEP, APART_STEP)
            net += part
            parts = [*parts, (part, own - off)]
            if net > best[0]:
                best = net, parts
            reach = far
        v = int(walls[v]["after" if sign > 0.0 else "before"])
    return best


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
