"""Directed corners as features: what peers that want points and correspondences are given.

A corner is where the lines of two segments cross near both. Two directions come with it, so that one matched corner
fixes a pose, and where the segments begin and end beyond it tells which corner can be which: what is seen of a segment
must lie on it. That, the angle, and votes for the heading leave the peers far fewer wrong correspondences than points
alone would.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._corner_kernels import cross_lines, explained, fit_corners

Floats = NDArray[np.float64]
Pose = tuple[float, float, float]

BIN = math.radians(3.0)  # of the votes for the heading
ON_MAP = np.array([0.15, math.radians(6.0)])  # m and radians; gates of what a pose explains


@dataclass(frozen=True, slots=True)
class CornerOptions:
    """Options for making and matching corners.

    Attributes
    ----------
    seen_reach, known_reach : float
        Metres; how far from its segments a corner of the scan and of the map may be.
    turn : float
        Degrees that the angles may differ.
    slack : float
        Metres that a segment may stick out.
    most : int
        Correspondences at most; those of corners near their segments come first.
    headings : int
        Number of of the headings with most votes are tried, 0 for all correspondences at once.
    """

    seen_reach: float = 1.0
    known_reach: float = 0.5
    turn: float = 4.0
    slack: float = 0.15
    most: int = 5000
    headings: int = 4


@dataclass(frozen=True, slots=True)
class MapCorners:
    """A map's segments and its corners, sorted by their angle."""

    segments: Floats
    corners: Floats

    @classmethod
    def of(cls, segments: Floats, options: CornerOptions) -> MapCorners:
        """Find the corners of a map."""
        found = cross_lines(segments, options.known_reach)
        return cls(segments, found[np.argsort(found[:, 3], kind="stable")])


@dataclass(frozen=True, slots=True)
class Matches:
    """Corresponding corners ``(k, 9)`` of scan and map."""

    seen: Floats
    known: Floats

    def __len__(self) -> int:
        return len(self.seen)

    def take(self, rows: NDArray[np.bool_] | NDArray[np.int64]) -> Matches:
        """Return some of them."""
        return Matches(self.seen[rows], self.known[rows])


def match(scan: Floats, known: MapCorners, options: CornerOptions) -> list[Matches]:
    """Return correspondences, one set for each heading that is tried."""
    seen = cross_lines(scan, options.seen_reach)
    order = np.argsort(seen[:, 8], kind="stable")
    gates = np.array([math.radians(options.turn), options.slack, options.most])
    pairs = fit_corners(seen, known.corners, order, gates)
    everything = Matches(seen[pairs[:, 0]], known.corners[pairs[:, 1]])
    if not options.headings:
        return [everything]
    turns = headings(everything)
    return [everything.take(_near(turns, peak)) for peak in _peaks(turns, options.headings)]


def headings(matches: Matches) -> Floats:
    """Return the heading that each correspondence votes for, by both of its segments; 0 to 2 pi."""
    first = matches.known[:, 2] - matches.seen[:, 2]
    both = first + 0.5 * (matches.known[:, 3] - matches.seen[:, 3])
    return np.asarray(np.mod(both, math.tau))


def _peaks(turns: Floats, count: int) -> list[float]:
    """Return the fullest headings, apart by more than their width."""
    bins = round(math.tau / BIN)
    votes = np.bincount((turns / BIN).astype(int) % bins, minlength=bins).astype(float)
    votes = votes + 0.5 * (np.roll(votes, 1) + np.roll(votes, -1))
    found = []
    for _ in range(count):
        k = int(votes.argmax())
        if votes[k] <= 0.0:
            break
        found.append((k + 0.5) * BIN)
        votes[(k + np.arange(-2, 3)) % bins] = 0.0
    return found


def _near(turns: Floats, peak: float) -> NDArray[np.bool_]:
    return np.abs(np.mod(turns - peak + math.pi, math.tau) - math.pi) < 2.0 * BIN


def fit_points(seen: Floats, known: Floats) -> Pose:
    """Return the least-squares pose of matched points ``(k, 2)``."""
    a, b = seen.mean(axis=0), known.mean(axis=0)
    p, q = seen - a, known - b
    theta = math.atan2((p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]).sum(), (p * q).sum())
    c, s = math.cos(theta), math.sin(theta)
    return float(b[0] - c * a[0] + s * a[1]), float(b[1] - s * a[0] - c * a[1]), theta


def best_of(poses: list[Pose], scan: Floats, known: Floats) -> Pose | None:
    """Return the pose that explains most of the scan's length."""
    if not poses:
        return None
    told = [explained(scan, known, np.array(pose), ON_MAP) for pose in poses]
    return poses[int(np.argmax(told))]
