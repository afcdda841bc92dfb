"""Twins of the kernels that propose poses."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from association import HardPrior
from association.search.tuning import WINDOW_MARGIN, WINDOW_TURN
from association.tuning import BASE_SLACK, BASE_SLACK_SHARE, MIN_CROSSING
from registration import RigidTransform
from registration.layout import Floats, Record, Records

from .geometry import direction, normal, point, rotation, translation, wrap


@dataclass(frozen=True)
class Proposal:
    """A pose, and what is known of it before any other segment is looked at."""

    pose: RigidTransform
    covariance: Floats


def end_slack(length: float) -> float:
    return BASE_SLACK + BASE_SLACK_SHARE * length


def half_length(segment: Record) -> float:
    """Return how far from its midpoint a segment of a base has to be on its wall."""
    return float(0.5 * segment["length"] - end_slack(segment["length"]))


def turning(theta_var: float, lever: Floats) -> Floats:
    """Return the covariance of a pose that turns about a point, `lever` from the sensor in the map's directions."""
    change = np.array([lever[1], -lever[0], 1.0])  # of (x, y, theta), by theta
    return theta_var * np.outer(change, change)


def base_pose(a: Record, b: Record, wa: Record, wb: Record) -> tuple[RigidTransform, bool]:
    """Turn the segments onto their lines, each by its share of the misfit; then lay the midpoints there."""
    gap = wrap(float(wb["angle"] - wa["angle"] - b["angle"] + a["angle"]))
    share = a["angle_variance"] / (a["angle_variance"] + b["angle_variance"])
    theta = float(wa["angle"] - a["angle"] + gap * share)
    normals = np.array([normal(wa), normal(wb)])
    middles = np.array([rotation(theta) @ point(a), rotation(theta) @ point(b)])
    offsets = np.array([wa["offset"], wb["offset"]])
    t = np.linalg.solve(normals, offsets - np.einsum("ij,ij->i", normals, middles))
    within = [
        lies_within(segment, middle + t, wall) for segment, middle, wall in zip((a, b), middles, (wa, wb), strict=True)
    ]
    return RigidTransform(float(t[0]), float(t[1]), theta), all(within)


def lies_within(segment: Record, middle: Floats, wall: Record) -> bool:
    along, half = direction(wall) @ middle, half_length(segment)
    return bool(wall["begin"] <= along - half and along + half <= wall["end"])


def placements(scan: Records, a: int, b: int, chains: Records, gates: Records) -> list[Proposal]:
    """Lay segments a and b of the scan on all pairs of chains."""
    gate, found = gates[0], []
    va, vb = float(scan[a]["angle_variance"]), float(scan[b]["angle_variance"])
    tolerance = float(np.clip(gate["sigmas"] * math.sqrt(va + vb), gate["least_angle"], gate["greatest_angle"]))
    pin = 0.5 * (point(scan[a]) + point(scan[b]))
    for wa in chains:
        lever = rotation(float(wa["angle"] - scan[a]["angle"])) @ pin
        for wb in chains:
            gap = float(wb["angle"] - wa["angle"] - scan[b]["angle"] + scan[a]["angle"])
            crossing = abs(normal(wa) @ direction(wb))
            if math.cos(gap) >= 1.0 - 0.5 * tolerance**2 and crossing >= MIN_CROSSING:
                pose, inside = base_pose(scan[a], scan[b], wa, wb)
                if inside:
                    found.append(Proposal(pose, turning(va * vb / (va + vb), lever)))
    return found


def slides(segment: Record, chains: Records, spacing: float, window: HardPrior | None = None) -> list[Proposal]:
    """Lay a segment on every chain that is long enough, at evenly spread places at most `spacing` apart.

    With a window those within its radius of where its middle lies along the chain.
    """
    found = []
    for chain in chains:
        low, high = chain["begin"] + half_length(segment), chain["end"] - half_length(segment)
        theta = float(chain["angle"] - segment["angle"])
        lever = rotation(theta) @ point(segment)
        if window is not None:
            middle = direction(chain) @ (translation(window.pose) + lever)
            low, high = max(low, middle - window.radius), min(high, middle + window.radius)
            if abs(wrap(theta - window.pose.theta)) > window.angle + WINDOW_TURN:
                continue
        if high < low:
            continue
        steps = max(1, math.ceil((high - low) / spacing))
        for along in low + (np.arange(steps) + 0.5) / steps * (high - low):
            x, y = along * direction(chain) + chain["offset"] * normal(chain) - lever
            covariance = turning(float(segment["angle_variance"]), lever)
            found.append(Proposal(RigidTransform(float(x), float(y), theta), covariance))
    return found


def may_be_refined_into(window: HardPrior, pose: RigidTransform) -> bool:
    """Tell whether a pose lies in a window or as near to it as is looked at."""
    return HardPrior(window.pose, window.radius + WINDOW_MARGIN, window.angle + WINDOW_TURN).contains(pose)
