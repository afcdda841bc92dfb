"""Input for kernels: scans of a maze, drawn by seed, with their poses."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

from association import AssociationOptions, HardPrior, MapIndex, MapPoints, Prior, SoftPrior
from association.layout import Indices
from association.scan.scan_lines import gates
from association.tables import Workspace
from registration import RigidTransform
from registration.layout import Floats, Records

from ..records import work_of
from ..reference.geometry import moved
from ..scenes import Truth, context_of, index_of, local, maze, scan_of, seen

SEEDS = st.integers(0, 2**31 - 1)
MAZE = maze(1)
INDEX = index_of(MAZE)
TABLES = INDEX.tables
PLACE = TABLES.place
POINTS = MapPoints(np.random.default_rng(2).uniform(0.0, 30.0, (300, 2)), 0.06)  # as the maze is wide
OBSTACLES = MapIndex.build(INDEX.segments, points=POINTS).obstacles
GATES = gates(AssociationOptions())
ASKED = context_of(INDEX, scan_of([[0.0, 0.0, 1.0, 0.0]])).question_of_a_pose  # under the usual options
MODEL = ASKED.terms["model"]
SMALL = np.diag([1e-4, 1e-4, 1e-6])  # a pose's covariance


@dataclass(frozen=True)
class Drawn:
    """A scan of the maze.

    Attributes
    ----------
    rng : numpy.random.Generator
        To draw more with.
    endpoints : (n, 4) in the scan frame
    truth : (n,) the wall of each segment or -1, by scan index
    row_of : (n,) the row that each segment is part of, by scan index
    scan : (rows,) of `SCAN_LINE`
    at : RigidTransform
        Index frame from scan frame.
    """

    rng: np.random.Generator
    endpoints: Floats
    truth: Truth
    row_of: Indices
    scan: Records
    at: RigidTransform

    def near(self, theta: float = 0.01, x: float = 0.05, y: float = 0.05) -> RigidTransform:
        """Draw a pose about the truth, with these standard deviations."""
        return moved(self.at, self.rng.normal(size=3) * [theta, x, y])


def drawn(seed: int, radius: float = 10.0, clutter: int = 5, index: MapIndex = INDEX) -> Drawn:
    """Draw a scan of what lies within `radius` of a place in the maze, half hidden, with 2 cm of noise."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(8.0, 22.0, 2)
    at = RigidTransform(x, y, rng.uniform(-3.0, 3.0))
    endpoints, truth = seen(MAZE, at, noise=0.02, cut=0.5, clutter=clutter, seed=seed, radius=radius)
    lines = context_of(index, scan_of(endpoints)).lines
    return Drawn(rng, endpoints, truth, lines.row_of, lines.rows, local(index, at))


def workspace_of(scan: Records, index: MapIndex = INDEX) -> Workspace:
    return work_of(len(scan), len(index.walls.rows))


def covariance(rng: np.random.Generator) -> Floats:
    """Draw the covariance of a pose some centimetres off, (x, y, theta)."""
    root = rng.normal(size=(3, 3)) * [[0.05], [0.05], [0.01]]
    return np.asarray(root @ root.T)


def in_pieces(rng: np.random.Generator) -> MapIndex:
    """Return the maze with walls cut up, pieces overlapping, and some of them coming twice."""
    pieces = []
    for wall in MAZE:
        a, d = wall[:2], wall[2:] - wall[:2]
        cuts = np.sort(rng.choice(19, rng.integers(1, 14), replace=False) + 1.0).tolist()
        for begin, end in itertools.pairwise([0.0, *cuts, 20.0]):
            pieces.append(np.concatenate([a + max(0.0, begin - 0.8) / 20.0 * d, a + end / 20.0 * d]))
    return index_of([*pieces, *pieces[::3]])


def oblique(rng: np.random.Generator) -> MapIndex:
    """Return the maze with every wall turned a little, so that there are all kinds of directions."""
    ends = MAZE.reshape(-1, 2, 2)
    middles, angles = ends.mean(axis=1, keepdims=True), rng.uniform(-0.6, 0.6, len(ends))
    c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
    x, y = np.moveaxis(ends - middles, -1, 0)
    return index_of((middles + np.stack([c * x - s * y, s * x + c * y], axis=-1)).reshape(-1, 4))


def prior_record(prior: Prior | None) -> Records:
    """Return a prior of the index frame as a record; the index lies about its own origin."""
    if prior is None:
        return context_of(INDEX, scan_of(np.zeros((0, 4)))).prior_record
    x, y = INDEX.origin
    there = RigidTransform(prior.pose.x + x, prior.pose.y + y, prior.pose.theta)
    if isinstance(prior, HardPrior):
        given: Prior = HardPrior(there, prior.radius, prior.angle)
    else:
        given = SoftPrior(there, prior.covariance)
    return context_of(INDEX, scan_of(np.zeros((0, 4))), given).prior_record
