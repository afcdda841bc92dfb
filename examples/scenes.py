"""The examples of the page: drawn maps and where a robot stands in them, as files of the package.

``python -m examples.scenes`` writes them to ``service/page/examples/``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from benchmarks.worlds import FAMILIES, free_place
from registration import RigidTransform, Segments
from simulation import OfficePlan, corridor, offices, outline

FOLDER = Path(__file__).parents[1] / "service" / "page" / "examples"
DIGITS = 3  # millimetres
Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Scene:
    """A map, furniture that it does not show, and where a robot stands.

    Attributes
    ----------
    title, about : str
        For people: what it is, and what there is to see.
    walls, boxes : (n, 4)
        Walls of the map, and objects that only the robot sees; metres.
    pose : RigidTransform
        map_from_scan.
    range_max : float
        Of the robot's scanner, metres.
    """

    title: str
    about: str
    walls: Floats
    boxes: Floats
    pose: RigidTransform
    range_max: float

    def document(self) -> dict[str, Any]:
        """Return it as JSON."""
        x, y, theta = (round(float(v), DIGITS) for v in (self.pose.x, self.pose.y, self.pose.theta))
        return {
            "title": self.title,
            "about": self.about,
            "map": {"segments": np.round(self.walls, DIGITS).tolist()},
            "boxes": np.round(self.boxes, DIGITS).tolist(),
            "pose": {"x": x, "y": y, "theta": theta},
            "laser": {"fov": round(math.tau, 6), "beams": 720, "range_max": self.range_max, "sigma": 0.02},
        }


def flat() -> Scene:
    """Draw a flat, one of a house of which no two are alike."""
    rng = np.random.default_rng(4)
    building = FAMILIES["apartments"].draw(rng).build(rng).segments
    return Scene(
        "A flat",
        "Rooms of different shapes. Only one pose explains the scan.",
        building.endpoints,
        np.zeros((0, 4)),
        free_place(building, rng, 0.8),
        12.0,
    )


def office() -> Scene:
    """Draw an office floor with a robot among furniture that is on no map."""
    floor = offices(np.random.default_rng(7), OfficePlan(rooms=5, corridors=2))
    pose = floor.poses[5]
    boxes = [_box(pose.x + 1.1, pose.y - 0.9, 0.6, 0.4, 0.3), _box(pose.x - 1.0, pose.y + 1.2, 0.8, 0.5, -0.2)]
    return Scene(
        "An office",
        "The map does not show the furniture. The walls are enough.",
        floor.segments.endpoints,
        np.vstack(boxes),
        RigidTransform(pose.x - 0.2, pose.y + 0.1, 0.6),
        15.0,
    )


def rooms() -> Scene:
    """Draw three equal rooms on a corridor."""
    step, depth, width = 4.15, 3.0, 4.0
    pieces = []
    for k in range(3):
        x, y = k * step, 2.15
        pieces.append(
            outline([(x + 1.5, y), (x + width, y), (x + width, y + depth), (x, y + depth), (x, y), (x + 0.6, y)])[:-1]
        )
        pieces.append(np.array([[x + 0.6, y, x + 0.6, 2.0], [x + 1.5, 2.0, x + 1.5, y]]))
    doors = [0.6 + k * step for k in range(3)]
    edges = [-1.0, *(e for a in doors for e in (a, a + 0.9)), 12.6]
    top = [[b, 2.0, a, 2.0] for a, b in zip(edges[::2], edges[1::2], strict=True)]
    hall = [[-1.0, 0.0, 12.6, 0.0], [12.6, 0.0, 12.6, 2.0], *top[::-1], [-1.0, 2.0, -1.0, 0.0]]
    return Scene(
        "Three equal rooms",
        "A scan from inside one of three equal rooms fits all of them. Drag the robot to the corridor.",
        np.vstack([*pieces, np.array(hall)]),
        np.zeros((0, 4)),
        RigidTransform(step + 2.6, 4.2, 1.9),
        10.0,
    )


def plain_corridor() -> Scene:
    """Draw a corridor without ends in sight."""
    return Scene(
        "A corridor",
        "Two parallel walls. The position along them is unobservable. Drag the robot to an end.",
        np.vstack([corridor(50.0, 2.4).segments.endpoints, [[25.0, -1.2, 25.0, 1.2]]]),
        np.zeros((0, 4)),
        RigidTransform(-3.0, 0.3, 0.2),
        8.0,
    )


def warehouse() -> Scene:
    """Draw a hall of racks."""
    rng = np.random.default_rng(2)
    building = FAMILIES["warehouse"].draw(rng).build(rng).segments
    return Scene(
        "A warehouse",
        "Rows of similar racks.",
        building.endpoints,
        np.zeros((0, 4)),
        free_place(building, rng, 0.8),
        20.0,
    )


SCENES: dict[str, Callable[[], Scene]] = {
    "flat": flat,
    "office": office,
    "rooms": rooms,
    "corridor": plain_corridor,
    "warehouse": warehouse,
}


def rendered(name: str) -> bytes:
    """Return one of the files."""
    return orjson.dumps(SCENES[name]().document()) + b"\n"


def _box(x: float, y: float, width: float, height: float, turn: float) -> Floats:
    """Return the faces of a box, free space outside."""
    corners = np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]]) * (0.5 * width, 0.5 * height)
    return outline([(float(a), float(b)) for a, b in RigidTransform(x, y, turn).apply(corners)])


def main() -> None:
    """Write the files."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in SCENES:
        (FOLDER / f"{name}.json").write_bytes(rendered(name))
        print(FOLDER / f"{name}.json", len(Segments.from_array(SCENES[name]().walls)), "walls")


if __name__ == "__main__":
    main()
