"""The estimators with known correspondences: against the Cramer-Rao bound, and against their slow references.

Segments are fitted by least squares to points that are spread evenly over straight walls and lie off them by
independent normal noise. The bound is that of the raw points on known map lines.

``python -m benchmarks.estimators [--trials 10000]``
"""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass

import numpy as np

from registration import MeasuredSegments, RegistrationOptions, RigidTransform, Segments, register, wrap_angle
from tests import reference

from .table import Row, at_most, print_rows, within

SIGMA = 0.02  # m
SPACING = 0.05  # m between the points on a wall
SEED = 20190901
TWINS = 40  # problems, of 3 to 12 pairs


@dataclass(frozen=True, slots=True)
class Scene:
    """Walls as a sensor sees them, and where it is.

    Attributes
    ----------
    name : str
    walls : Segments
        In the scan frame.
    pose : RigidTransform
        map_from_scan.
    """

    name: str
    walls: Segments
    pose: RigidTransform

    @property
    def map(self) -> Segments:
        """The walls in the map frame."""
        return Segments.from_array(self.pose.apply(self.walls.endpoints.reshape(-1, 2, 2)).reshape(-1, 4))


def scenes(rng: np.random.Generator) -> list[Scene]:
    """Return walls around the sensor, walls to one side far away, an oblique few, and a map far from its origin."""
    around = _walls(rng, 20, (0.0, 0.0))
    return [
        Scene("20 walls around the sensor", around, RigidTransform(3.0, -2.0, 0.7)),
        Scene("20 walls, 58 m from the sensor", _walls(rng, 20, (50.0, 30.0)), RigidTransform(-7.0, 4.0, 2.5)),
        Scene("3 walls", _walls(rng, 3, (0.0, 0.0)), RigidTransform(0.0, 0.0, -3.0)),
        Scene("20 walls, map at 5e6 m", around, RigidTransform(5e5, 5e6, 0.7)),
    ]


def _walls(rng: np.random.Generator, count: int, centre: tuple[float, float]) -> Segments:
    angles, lengths = rng.uniform(-math.pi, math.pi, count), rng.uniform(0.5, 5.0, count)
    angles[:2] = 0.2, 1.8  # a scene with no unique pose would say nothing
    half = 0.5 * lengths[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    middle = np.array(centre) + rng.uniform(-8.0, 8.0, (count, 2))
    return Segments.from_array(np.hstack([middle - half, middle + half]))


def measure(walls: Segments, rng: np.random.Generator) -> MeasuredSegments:
    """Fit a segment by total least squares to noisy points on each wall."""
    points, starts, counts = _points(walls)
    noisy = points + rng.normal(0.0, SIGMA, points.shape)
    means = np.add.reduceat(noisy, starts) / counts[:, None]
    x, y = (noisy - np.repeat(means, counts, axis=0)).T
    xx, yy, xy = (np.add.reduceat(v, starts) for v in (x * x, y * y, x * y))
    angles = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    d = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    d *= np.where(np.einsum("ij,ij->i", d, walls.directions) < 0.0, -1.0, 1.0)[:, None]
    along = x * np.repeat(d[:, 0], counts) + y * np.repeat(d[:, 1], counts)
    begin, end = np.minimum.reduceat(along, starts), np.maximum.reduceat(along, starts)
    segments = Segments.from_array(np.hstack([means + begin[:, None] * d, means + end[:, None] * d]))
    spreads = np.add.reduceat(along**2, starts) / counts
    return MeasuredSegments.from_segments(segments, SIGMA, counts.astype(float), (means, spreads))


def _points(walls: Segments) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points in the middle of equal parts of each wall, where each wall's begin, and how many it has."""
    counts = np.maximum(3, np.round(walls.lengths / SPACING)).astype(int)
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    wall = np.repeat(np.arange(len(walls)), counts)
    along = (np.arange(counts.sum()) - starts[wall] + 0.5) / counts[wall] * walls.lengths[wall]
    return walls.endpoints[wall, :2] + along[:, None] * walls.directions[wall], starts, counts


def bound(scene: Scene) -> np.ndarray:
    """Return the least covariance of (x, y, theta) that the points allow, (3, 3); m^2, m rad, rad^2."""
    turned = reference.rotation(scene.pose.theta) @ reference.TURN
    points, _, counts = _points(scene.walls)
    normals = np.repeat(scene.map.normals, counts, axis=0)
    jacobian = np.column_stack([normals, np.einsum("ij,ij->i", points @ turned.T, normals)])
    return np.linalg.inv(jacobian.T @ jacobian / SIGMA**2)


def efficiency_rows(trials: int) -> list[Row]:
    """Estimate many times; judge residuals against the bound and against what the answers claim."""
    rng = np.random.default_rng(SEED)
    rows = []
    for scene in scenes(rng):
        map, pairs, least = scene.map, np.repeat(np.arange(len(scene.walls)), 2).reshape(-1, 2), bound(scene)
        off, nees = np.zeros((trials, 3)), np.zeros(trials)
        for k in range(trials):
            found = register(map, measure(scene.walls, rng), pairs)
            if found.pose is None or found.covariance is None:
                raise RuntimeError(f"{scene.name}: trial {k} has no pose, so there is nothing to judge")
            turn = wrap_angle(found.pose.theta - scene.pose.theta)
            off[k] = found.pose.x - scene.pose.x, found.pose.y - scene.pose.y, turn
            nees[k] = off[k] @ np.linalg.solve(found.covariance, off[k])
        position = math.sqrt(np.mean(off[:, 0] ** 2 + off[:, 1] ** 2) / (least[0, 0] + least[1, 1]))
        heading = math.sqrt(np.mean(off[:, 2] ** 2) / least[2, 2])
        rows.append(at_most(f"joint, {scene.name}: position RMS over the bound", position, 1.03))
        rows.append(at_most(f"joint, {scene.name}: heading RMS over the bound", heading, 1.03))
        rows.append(within(f"joint, {scene.name}: NEES", float(nees.mean()), 2.9, 3.1))
    return rows


def twin_rows() -> list[Row]:
    """Compare both estimators with their references, metres and radians."""
    rng = np.random.default_rng(SEED)
    worst = {"joint": 0.0, "one_step, Wahba": 0.0, "one_step, Mitsuta": 0.0}
    for _ in range(TWINS):
        scene = Scene("", _walls(rng, int(rng.integers(3, 13)), (0.0, 0.0)), RigidTransform(*rng.uniform(-3.0, 3.0, 3)))
        scan = measure(scene.walls, rng)
        for name in worst:
            worst[name] = max(worst[name], _twin_difference(name, scene.map, scan))
    return [
        at_most(f"{name}, greatest difference from its reference", v, 1e-9, form=".1e") for name, v in worst.items()
    ]


def _twin_difference(name: str, map: Segments, scan: MeasuredSegments) -> float:
    pairs = np.repeat(np.arange(len(scan)), 2).reshape(-1, 2)
    weights, s = scan.point_counts / scan.sigma**2, scan.segments
    rotation = "mitsuta" if name.endswith("Mitsuta") else "wahba"
    estimator = "joint" if name == "joint" else "one_step"
    options = RegistrationOptions(estimator=estimator, rotation=rotation)  # type: ignore[arg-type]
    found = register(map, scan, pairs, 0.0, options).pose
    if found is None:
        return math.inf
    theta = reference.wahba(map.directions, s.directions, weights)
    if name == "joint":
        data = map.normals, map.offsets, scan.centroids, s.directions, scan.spreads, weights
        theta, t = reference.joint_solve(theta, *data)
    else:
        corners = zip(map.directions, map.midpoints, s.directions, s.midpoints, strict=True)
        lines = [reference.transformation_line(*row) for row in corners]
        if rotation == "mitsuta":
            angles = [theta + math.remainder(a - theta, math.tau) for _, _, a in lines]
            theta = reference.mitsuta(angles, weights)[0] / weights.sum()
        # The translation is that of the scan turned first: the lines of Eq. (1) do not depend on the rotation.
        t = reference.one_step_translation(lines, weights)
    return float(max(abs(wrap_angle(found.theta - theta)), abs(found.x - t[0]), abs(found.y - t[1])))


def estimators(trials: int) -> list[Row]:
    """Return all rows."""
    return [*twin_rows(), *efficiency_rows(trials)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=10_000)
    trials = parser.parse_args().trials
    print_rows(f"Estimators, {trials} trials a scene", estimators(trials))


if __name__ == "__main__":
    main()
