"""Drive until the verdict is `ok`: every two metres one more view, and the places that still explain all of them.

``python -m examples.drive`` drives along a drawn corridor that repeats itself; the picture is ``out/drive.png``.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from formats.colours import AMBIGUOUS, INK, USABLE
from registration import RigidTransform, Segments
from simulation import Scanner, scan

from .call import call
from .running import running_service

matplotlib.use("Agg")
Floats = NDArray[np.float64]

OUT = Path("out") / "drive.png"
DRIFT = np.array([0.02, 0.02, math.radians(1.0)])  # m, m, rad after a metre; standard deviations of a random walk
MOST_VIEWS = 24
SHOWN = 6  # pictures at most
NEARLY = 0.93  # of the best score; places that explain as much are shown
GREEN, ORANGE, GREY = USABLE, AMBIGUOUS, "#a9b1ba"


@dataclass(frozen=True)
class Drive:
    """A way through a building: its map, and what the laser said at each place with where that was."""

    name: str
    walls: Segments
    lasers: list[dict[str, Any]]
    poses: list[RigidTransform]


def main() -> int:
    """Drive, print what each view tells, draw; the status is 1 where the drive ends without a usable answer."""
    ride = drawn_drive()
    print(f"{ride.name}: {len(ride.poses)} places, {len(ride.walls)} segments in the map", flush=True)
    with running_service() as (url, _):
        call(url, "PUT", "/v1/maps/drive", {"segments": ride.walls.endpoints.tolist()})
        answers = ask_on_the_way(url, ride)
    draw(ride, answers)
    print(f"picture: {OUT}")
    return 0 if answers[-1]["usable"] else 1


def drawn_drive() -> Drive:
    """Return a drive along a corridor whose niches repeat every 8 m, up to its last quarter, where they are wider."""
    length, slots, pitch = 60.0, 12, 4.0
    lower, upper = [(0.0, -2.0)], [(length, 0.0)]
    for k in range(0, slots, 2):
        x = k * pitch + 1.0
        lower += [(x, -2.0), (x, -2.7), (x + 1.2, -2.7), (x + 1.2, -2.0)]
    for x in (48.5, 53.5):
        lower += [(x, -2.0), (x, -3.5), (x + 3.0, -3.5), (x + 3.0, -2.0)]
    upper += [(57.5, 0.0), (57.5, 1.5), (52.0, 1.5), (52.0, 0.0)]
    for k in range(slots - 1, 0, -2):
        x = k * pitch + 2.2
        upper += [(x, 0.0), (x, 0.7), (x - 1.2, 0.7), (x - 1.2, 0.0)]
    corners = np.array([*lower, (length, -2.0), *upper, (0.0, 0.0)])
    segments = Segments.from_array(np.hstack([corners, np.roll(corners, -1, axis=0)]))
    poses = [RigidTransform(13.0 + 2.0 * k, -1.0 + 0.05 * (k % 3), 0.02 * (k % 5)) for k in range(20)]
    scanner, rng = Scanner.over(1.5 * math.pi, 541, range_max=6.0), np.random.default_rng(5)
    lasers = []
    for pose in poses:
        ranges = scan(segments, pose, scanner, rng).ranges
        lasers.append(
            {
                "angle_min": scanner.angle_min,
                "angle_increment": scanner.angle_increment,
                "range_max": scanner.range_max,
                "ranges": [round(r, 4) if math.isfinite(r) else 1e3 for r in ranges.tolist()],
            }
        )
    return Drive("a corridor with niches", segments, lasers, poses)


def ask_on_the_way(url: str, ride: Drive) -> list[dict[str, Any]]:
    """Ask at every place, with all views so far, until the answer is usable."""
    rng, steps, answers = np.random.default_rng(1), [], []
    for k, pose in enumerate(ride.poses):
        if k:
            step = ride.poses[k - 1].inverse().compose(pose)
            far = math.hypot(step.x, step.y)
            x, y, theta = (rng.normal(size=3) * DRIFT * math.sqrt(far)).tolist()
            steps.append(RigidTransform(step.x + x, step.y + y, step.theta + theta))
        request = {"views": views_of(ride, steps, k)}
        asked = {"map": {"map_id": "drive"}, "scan": request, "options": {"max_alternatives": 20}}
        answer = call(url, "POST", "/v1/associate", asked)
        answers.append(answer)
        others = sum(other["score"] > NEARLY * score_of(answer) for other in answer["alternatives"])
        why = ", ".join(reason["code"] for reason in answer["reasons"]) or "-"
        print(
            f"{k + 1:3d} views: {answer['status']:10s} {others} other places explain nearly as much; {why}", flush=True
        )
        if answer["usable"]:
            break
    return answers


def views_of(ride: Drive, steps: list[RigidTransform], latest: int) -> list[dict[str, Any]]:
    """Return the latest view and those before it, each relative to the one after it."""
    views: list[dict[str, Any]] = [{"laser": ride.lasers[latest], "pose": {"x": 0.0, "y": 0.0, "theta": 0.0}}]
    at = RigidTransform(0.0, 0.0, 0.0)
    for k in range(latest - 1, max(-1, latest - MOST_VIEWS), -1):
        back = steps[k].inverse()
        at = at.compose(back)
        sigmas = DRIFT * math.sqrt(math.hypot(back.x, back.y))
        views.append(
            {
                "laser": ride.lasers[k],
                "pose": {"x": at.x, "y": at.y, "theta": at.theta},
                "covariance": np.diag(sigmas**2).tolist(),
                "relative_to": len(views) - 1,
            }
        )
    return views


def score_of(answer: dict[str, Any]) -> float:
    """Return the score of an answer; of one that matched nothing that of the best alternative."""
    if answer["diagnostics"] is not None:
        return float(answer["diagnostics"]["score"])
    return max((other["score"] for other in answer["alternatives"]), default=0.0)


def draw(ride: Drive, answers: list[dict[str, Any]]) -> None:
    """Draw where the robot may be, after some of the views, the last among them."""
    chosen = sorted({round(k) for k in np.linspace(0, len(answers) - 1, min(SHOWN, len(answers)))})
    figure = Figure(figsize=(9.0, 0.5 + 1.2 * len(chosen)), dpi=100, facecolor="white", layout="constrained")
    for axes, k in zip(np.atleast_1d(figure.subplots(len(chosen), 1)), chosen, strict=True):
        answer = answers[k]
        axes.add_collection(LineCollection(list(ride.walls.endpoints.reshape(-1, 2, 2)), colors=GREY, linewidths=1.0))
        for other in answer["alternatives"]:
            if other["score"] > NEARLY * score_of(answer):
                axes.plot(other["pose"]["x"], other["pose"]["y"], "o", color=ORANGE, markersize=7)
        if answer["pose"] is not None:
            colour, mark = (GREEN, "*") if answer["usable"] else (ORANGE, "o")
            axes.plot(answer["pose"]["x"], answer["pose"]["y"], mark, color=colour, markersize=12)
        axes.plot(ride.poses[k].x, ride.poses[k].y, "+", color=INK, markersize=12)
        axes.set_title(f"{k + 1} views: {answer['status']}", loc="left", fontsize=10)
        axes.set_aspect("equal")
        axes.autoscale_view()
        axes.axis("off")
    OUT.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(OUT)


if __name__ == "__main__":
    sys.exit(main())
