"""The demo's building, drawn from a seed, and four scans: three of places in it, one of a place elsewhere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform, Segments
from simulation import OfficePlan, Scanner, SimulatedScan, World, oblique, offices, outline, scan, with_obstacles

Floats = NDArray[np.float64]

SEED = 7
SCANNER = Scanner(range_max=10.0, sigma=0.02, dropout=0.02)  # 360 degrees, 1,080 beams
BRIDGE = 32.0  # m of plain corridor
ROOMS = 3  # equal ones at its end
ROOM_WIDTH, ROOM_DEPTH, DOOR = 4.0, 3.0, (0.6, 1.5)  # m; the door from and to, along the width
OFFICES = OfficePlan(rooms=4, corridors=2)
LOW, HIGH = OFFICES.depth + OFFICES.wall, OFFICES.depth + OFFICES.wall + OFFICES.corridor_width  # m; the bridge's walls
BOXES_IN_OFFICES, BOXES_IN_ROOMS = 30, 5  # furniture that no map knows


@dataclass(frozen=True)
class Case:
    """A scan to be found, and what is true of it.

    Attributes
    ----------
    title : str
        Place of the robot, in words.
    expected : str
        The status that is the honest answer.
    truth : RigidTransform or None
        map_from_scan; None where the scan is of another building.
    scan : SimulatedScan
    """

    title: str
    expected: str
    truth: RigidTransform | None
    scan: SimulatedScan


def draw_cases() -> tuple[Segments, list[Case]]:
    """Return the map and the four scans."""
    rng = np.random.default_rng(SEED)
    floor = offices(rng, OFFICES)
    walls = floor.segments.endpoints
    # The first corridor's right end is opened: the bridge begins there.
    is_end = (walls[:, 0] == walls[:, 2]) & (walls[:, 1] == LOW) & (walls[:, 3] == HIGH)
    start = float(walls[is_end, 0].max())
    end = start + BRIDGE
    lefts = [end - (ROOMS - k) * (ROOM_WIDTH + OFFICES.wall) + OFFICES.wall for k in range(ROOMS)]
    rooms = np.vstack([_room(left) for left in lefts])
    building = Segments.from_array(np.vstack([walls[~is_end], _bridge(start, end, lefts), rooms]))

    place = RigidTransform(floor.poses[3].x - 0.6, floor.poses[3].y + 0.5, 0.6)
    room = RigidTransform(lefts[1] + 2.4, HIGH + OFFICES.wall + 0.55 * ROOM_DEPTH, 1.9)
    bridge = RigidTransform(start + 0.36 * BRIDGE, 0.5 * (LOW + HIGH) + 0.2, -0.15)
    furniture = [
        _furniture(floor.segments.endpoints, place, BOXES_IN_OFFICES, rng),
        _furniture(rooms, room, BOXES_IN_ROOMS, rng),
    ]
    furnished = Segments.from_array(np.vstack([building.endpoints, *furniture]))
    elsewhere = oblique()

    def seen(walls: Segments, pose: RigidTransform) -> SimulatedScan:
        return scan(walls, pose, SCANNER, rng)

    return building, [
        Case("a place like no other", "ok", place, seen(furnished, place)),
        Case("one of three equal rooms", "ambiguous", room, seen(furnished, room)),
        Case("a plain corridor", "degenerate", bridge, seen(furnished, bridge)),
        Case("another building", "no_match", None, seen(elsewhere.segments, elsewhere.poses[3])),
    ]


def _bridge(start: float, end: float, rooms: list[float]) -> Floats:
    """Return a corridor's walls, the upper one open where the rooms' doors are."""
    openings = [x for left in rooms for x in (left + DOOR[0], left + DOOR[1])]
    edges = [start, *openings, end]
    upper = [[b, HIGH, a, HIGH] for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return np.array([[start, LOW, end, LOW], [end, LOW, end, HIGH], *upper])


def _room(left: float) -> Floats:
    """Return a room above the bridge and the sides of its door."""
    near, far = HIGH + OFFICES.wall, HIGH + OFFICES.wall + ROOM_DEPTH
    a, b, right = left + DOOR[0], left + DOOR[1], left + ROOM_WIDTH
    around = outline([(left, near), (a, near), (b, near), (right, near), (right, far), (left, far)])
    return np.vstack([np.delete(around, 1, axis=0), [[a, near, a, HIGH], [b, HIGH, b, near]]])


def _furniture(walls: Floats, place: RigidTransform, boxes: int, rng: np.random.Generator) -> Floats:
    """Return the sides of boxes that stand anywhere between the walls but on the robot."""
    world = World("empty", Segments.from_array(walls), (place,), len(walls))
    return with_obstacles(world, boxes, rng).segments.endpoints[len(walls) :]
