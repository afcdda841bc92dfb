"""One scan and the map that it is searched in, drawn by the names of a family and a condition, and a number."""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform, Segments
from simulation import Scanner, SimulationError, scan

from .buildings import FAMILIES, Style
from .changes import clutter
from .conditions import BEAMS, CONDITIONS, RANGE_MAX, Stranger
from .map_errors import clipped
from .places import free_place

Floats = NDArray[np.float64]

RADIUS = (2.0, 6.0)  # m; of a window
BEYOND = (1.0, 15.0)  # m; by how much the truth lies outside of it
ANGLES = (0.5, math.pi)  # rad; half of a window's headings

MARGIN = 0.5  # m; between what is seen and the part that is mapped
MAPPED = (0.3, 0.9)  # share of the walls' length that is
PLACES = 60  # to look for one from which nothing of a large part is seen
DRAWS = 20  # of buildings, until one has such a place, or room for its clutter


@dataclass(frozen=True, slots=True)
class Window:
    """The window of a search: `radius` metres and `angle` radians around `pose`, in the map frame."""

    pose: RigidTransform
    radius: float
    angle: float


@dataclass(frozen=True, slots=True)
class Case:
    """A scan and the map that it is searched in.

    Attributes
    ----------
    world, condition : str
        Names in `FAMILIES` and `CONDITIONS`.
    number : int
        The three together are the seed.
    map : Segments
        Metres in a frame of its own.
    scanner : Scanner
        As it is declared.
    ranges : (m,) metres
        As it reports them.
    truth : RigidTransform or None
        map_from_scan; None for an out-of-map scan, for which no answer is right.
    window : Window or None
        The only place to look, where there is one.
    scene : Segments
        All that stood there when the scan was taken, metres in the building's frame; things that no map knows last.
    pose : RigidTransform
        Of the scanner in that frame.
    clutter : float
        Share of the beams that end on people and pallets.
    shown : Segments
        The walls that the map should show: those of the building or a part of it, in that frame; of another building
        in its own.
    """

    world: str
    condition: str
    number: int
    map: Segments
    scanner: Scanner
    ranges: Floats = field(repr=False)
    truth: RigidTransform | None
    window: Window | None
    scene: Segments = field(repr=False)
    pose: RigidTransform
    clutter: float
    shown: Segments = field(repr=False)

    @property
    def points(self) -> Floats:
        """The measured points in the scan frame as the declared scanner has them, ``(k, 2)`` metres."""
        seen = np.isfinite(self.ranges)
        angles, r = self.scanner.angles[seen], self.ranges[seen]
        return np.stack([r * np.cos(angles), r * np.sin(angles)], axis=1)


def draw_case(world: str, condition: str, number: int) -> Case:
    """Draw a case; the same three draw the same.

    Parameters
    ----------
    world : str
        A name in `FAMILIES`.
    condition : str
        A name in `CONDITIONS`.
    number : int
        From 0 up.

    Raises
    ------
    SimulationError
        When a name is unknown.
    """
    for argument, name, known in (("world", world, FAMILIES), ("condition", condition, CONDITIONS)):
        if name not in known:
            raise SimulationError(f"expected one of {', '.join(known)}; found {name!r}", argument=argument)
    rng = np.random.default_rng([zlib.crc32(world.encode()), zlib.crc32(condition.encode()), number])
    for _ in range(DRAWS):
        case = _attempt(world, condition, number, rng)
        if case is not None:
            return case
    raise SimulationError(f"drew no building that fits {condition} in {DRAWS} attempts", argument="world")


def _attempt(world: str, condition: str, number: int, rng: np.random.Generator) -> Case | None:
    """Draw a building and a place in it; None where the condition does not fit them."""
    rule = CONDITIONS[condition]
    style = FAMILIES[world].draw(rng)
    building = style.build(rng)
    standing = rule.today(building, rng).segments
    known: Segments | None = _searched(world, style, building.segments, rule.stranger, rng)
    pose = free_place(standing, rng)
    if rule.stranger is Stranger.UNMAPPED:
        pose, known = _unmapped_part(building.segments, standing, rng)
    if known is None:
        return None
    declared = rule.draw_laser(rng)
    laser = rule.laser(declared, rng)
    people, share = np.zeros((0, 4)), 0.0
    if rule.clutter > 0.0:
        found = clutter(standing, pose, laser, rule.clutter, rng)
        if found is None:
            return None
        people, share = found
    scene = Segments.from_array(np.vstack([standing.endpoints, people]))
    seen = scan(scene, pose, laser, rng)
    drawn = rule.draw_map(known, rng).laid(rng)
    truth = drawn.pose(pose)
    told = declared
    if rule.corrected:
        told = replace(declared, angle_min=laser.angle_min, angle_increment=laser.angle_increment)
    return Case(
        world=world,
        condition=condition,
        number=number,
        map=drawn.segments,
        scanner=told,
        ranges=seen.ranges,
        truth=truth if rule.stranger is None else None,
        window=_window_elsewhere(truth, drawn.segments, rng) if rule.stranger is Stranger.WINDOW else None,
        scene=scene,
        pose=pose,
        clutter=share,
        shown=known,
    )


def _searched(world: str, style: Style, own: Segments, stranger: Stranger | None, rng: np.random.Generator) -> Segments:
    """Return what the map shows that is searched: the building itself, a sister, or something else of its half."""
    if stranger is Stranger.SISTER:
        return style.build(rng).segments
    if stranger is Stranger.OTHER_TYPE:
        held_out = FAMILIES[world].held_out
        others = [name for name, family in FAMILIES.items() if name != world and family.held_out == held_out]
        return FAMILIES[str(rng.choice(others))].draw(rng).build(rng).segments
    return own


def _unmapped_part(
    segments: Segments, standing: Segments, rng: np.random.Generator
) -> tuple[RigidTransform, Segments | None]:
    """Find a place from which nothing is seen of some part of the building that is large enough for a map.

    The part is cut off by a line along or across the building, just beyond what a laser sees at its farthest.

    Parameters
    ----------
    segments : Segments
        Of the building as it was mapped.
    standing : Segments
        Of the same when it is scanned.
    rng : numpy.random.Generator

    Returns
    -------
    RigidTransform
    Segments or None
        The part; None where no place was found.
    """
    pose = free_place(standing, rng)
    total = segments.lengths.sum()
    for _ in range(PLACES):
        seen = scan(standing, pose, Scanner.over(math.tau, BEAMS, range_max=RANGE_MAX[1], sigma=0.0))
        points = pose.apply(seen.points)
        for axis in rng.permutation(4):
            normal = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][axis])
            part = clipped(segments, normal, float((points @ normal).min()) - MARGIN)
            if MAPPED[0] <= part.lengths.sum() / total <= MAPPED[1]:
                return pose, part
        pose = free_place(standing, rng)
    return pose, None


def _window_elsewhere(truth: RigidTransform, segments: Segments, rng: np.random.Generator) -> Window:
    """Draw a window of the map that the truth lies outside of, its middle near some wall."""
    walls = segments.midpoints
    away = np.hypot(walls[:, 0] - truth.x, walls[:, 1] - truth.y)
    radius = rng.uniform(*RADIUS)
    nearest, farthest = radius + BEYOND[0], radius + BEYOND[1]
    fitting = np.flatnonzero((away > nearest + 1.0) & (away < farthest))
    if len(fitting):
        x, y = walls[fitting[int(rng.integers(len(fitting)))]] + rng.uniform(-0.7, 0.7, 2)
    else:
        bearing = rng.uniform(0.0, math.tau)
        x, y = truth.x + nearest * math.cos(bearing), truth.y + nearest * math.sin(bearing)
    heading = rng.uniform(-math.pi, math.pi)
    return Window(RigidTransform(float(x), float(y), heading), radius, float(rng.choice(ANGLES)))
