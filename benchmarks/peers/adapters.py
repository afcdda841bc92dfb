"""The peers, each asked in the formulation that suits it best, and Linefix asked the same.

A peer gets ready for a map once (`prepare`, not timed: a stored map) and then locates scans. Each imports its package
when it is made, so that one that is missing is missed alone.
"""

from __future__ import annotations

import functools
import importlib.util
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from association import AssociationOptions, HardPrior, MapIndex, Scan, associate
from registration import MeasuredSegments, RigidTransform, Segments

from ._corner_kernels import affinities
from .corners import CornerOptions, MapCorners, Matches, Pose, best_of, fit_points, headings, match
from .scenes import PeerQuery

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Answer:
    """A pose ``(x, y, theta)`` or None, and whether the solver itself would go by it; None where it cannot say."""

    pose: Pose | None
    usable: bool | None = None


class Peer(Protocol):
    """Something that locates scans in a prepared map."""

    def prepare(self, segments: Floats) -> Any:
        """Work out once what only the map is needed for."""
        ...

    def locate(self, prepared: Any, query: PeerQuery) -> Answer:
        """Find the scan."""
        ...


@dataclass(frozen=True)
class Linefix:
    """`association.associate`, from nothing or within a window about the guess."""

    guided: bool = False

    def prepare(self, segments: Floats) -> MapIndex:
        """Build the index."""
        return MapIndex.build(Segments.from_array(segments))

    def locate(self, prepared: MapIndex, query: PeerQuery) -> Answer:
        """Search for the pose alone; what is not seen from one place is sent so, two measured points a segment."""
        segments = Segments.from_array(query.scan)
        if query.one_place:
            scan = Scan(MeasuredSegments.from_segments(segments, query.sigma))
        else:
            ends = np.full(len(segments), 2.0), (segments.midpoints, 0.25 * segments.lengths**2)
            scan = Scan(MeasuredSegments.from_segments(segments, query.sigma, *ends), viewpoint=None)
        prior = HardPrior(query.guess, 1.0, math.radians(20.0)) if self.guided else None
        found = associate(prepared, scan, prior, AssociationOptions(include=()))
        pose = None if found.pose is None else (found.pose.x, found.pose.y, found.pose.theta)
        return Answer(pose, found.usable)


@dataclass(frozen=True)
class OfCorners:
    """A peer that is given matched corners, heading by heading; the pose that explains most is its answer."""

    options: CornerOptions = field(default_factory=CornerOptions)

    def prepare(self, segments: Floats) -> MapCorners:
        """Find the map's corners."""
        return MapCorners.of(segments, self.options)

    def locate(self, prepared: MapCorners, query: PeerQuery) -> Answer:
        """Match corners, solve for each heading, choose."""
        poses = [self.solve(matches) for matches in match(query.scan, prepared, self.options) if len(matches) >= 2]
        return Answer(best_of([p for p in poses if p is not None], query.scan, prepared.segments))

    def solve(self, matches: Matches) -> Pose | None:
        """Return the pose of correspondences most of which are wrong."""
        raise NotImplementedError


@dataclass(frozen=True)
class KissMatcher(OfCorners):
    """KISS-Matcher: prune by pairwise distances (ROBIN), then graduated non-convexity, rotation about z only.

    Attributes
    ----------
    bound, gain : float
        Metres that distances may differ, and the share of it that the solver allows.
    tips : bool
        True if a second point, a metre along the first segment, lets distances see directions.
    """

    bound: float = 0.15
    gain: float = 1.0
    tips: bool = False

    def __post_init__(self) -> None:
        import kiss_matcher

        config = kiss_matcher.KISSMatcherConfig(
            voxel_size=self.bound,
            use_quatro=True,
            robin_noise_bound_gain=1.0,
            solver_noise_bound_gain=self.gain,
            enable_noise_bound_clamping=False,
        )
        object.__setattr__(self, "solver", kiss_matcher.KISSMatcher(config))

    def solve(self, matches: Matches) -> Pose | None:
        """Run `prune_and_solve`."""
        solver: Any = self.solver  # type: ignore[attr-defined]
        solver.reset_solver()
        found = solver.prune_and_solve(list(self._lifted(matches.seen)), list(self._lifted(matches.known)))
        if not found.valid:
            return None
        r, t = found.rotation, found.translation
        return float(t[0]), float(t[1]), math.atan2(r[1, 0], r[0, 0])

    def _lifted(self, corners: Floats) -> NDArray[np.float32]:
        points = corners[:, :2]
        if self.tips:
            points = np.vstack([points, points + np.stack([np.cos(corners[:, 2]), np.sin(corners[:, 2])], axis=1)])
        return np.hstack([points, np.zeros((len(points), 1))]).astype(np.float32)


@dataclass(frozen=True)
class OpenCv(OfCorners):
    """OpenCV's `estimateAffinePartial2D` on points; a pose that scales is none."""

    threshold: float = 0.15
    trials: int = 2000

    def __post_init__(self) -> None:
        import cv2

        cv2.setNumThreads(1)
        object.__setattr__(self, "cv2", cv2)

    def solve(self, matches: Matches) -> Pose | None:
        """Run RANSAC with refinement."""
        cv2: Any = self.cv2  # type: ignore[attr-defined]
        found, _ = cv2.estimateAffinePartial2D(
            np.ascontiguousarray(matches.seen[:, :2]),
            np.ascontiguousarray(matches.known[:, :2]),
            method=cv2.RANSAC,
            ransacReprojThreshold=self.threshold,
            maxIters=self.trials,
            confidence=0.999,
            refineIters=10,
        )
        if found is None or not np.isfinite(found).all() or abs(math.hypot(found[0, 0], found[1, 0]) - 1.0) > 0.1:
            return None
        return float(found[0, 2]), float(found[1, 2]), math.atan2(found[1, 0], found[0, 0])


@dataclass(frozen=True)
class Open3d(OfCorners):
    """Open3D's RANSAC on correspondences of three points, checked by edge lengths, distances and normals."""

    threshold: float = 0.2
    trials: int = 20_000

    def __post_init__(self) -> None:
        import open3d

        object.__setattr__(self, "open3d", open3d)

    def solve(self, matches: Matches) -> Pose | None:
        """Run it; the first segment's direction is each point's normal, so that no mirror image passes."""
        if len(matches) < 3:
            return None
        o3d: Any = self.open3d  # type: ignore[attr-defined]
        p = o3d.pipelines.registration
        o3d.utility.random.seed(0)
        rows = np.repeat(np.arange(len(matches), dtype=np.int32), 2).reshape(-1, 2)
        checks = [
            p.CorrespondenceCheckerBasedOnEdgeLength(0.8),
            p.CorrespondenceCheckerBasedOnDistance(self.threshold),
            p.CorrespondenceCheckerBasedOnNormal(math.radians(10.0)),
        ]
        found = p.registration_ransac_based_on_correspondence(
            self._cloud(matches.seen),
            self._cloud(matches.known),
            o3d.utility.Vector2iVector(rows),
            self.threshold,
            p.TransformationEstimationPointToPoint(False),
            3,
            checks,
            p.RANSACConvergenceCriteria(self.trials, 0.999),
        )
        m = found.transformation
        if found.fitness <= 0.0 or m[2, 2] < 0.9:
            return None
        return float(m[0, 3]), float(m[1, 3]), math.atan2(m[1, 0], m[0, 0])

    def _cloud(self, corners: Floats) -> Any:
        o3d: Any = self.open3d  # type: ignore[attr-defined]
        cloud = o3d.geometry.PointCloud()
        flat = np.zeros((len(corners), 1))
        cloud.points = o3d.utility.Vector3dVector(np.hstack([corners[:, :2], flat]))
        normals = np.hstack([np.cos(corners[:, 2:3]), np.sin(corners[:, 2:3]), flat])
        cloud.normals = o3d.utility.Vector3dVector(normals)
        return cloud


class CornerModel:
    """A pose for scikit-image's `ransac`: of one matched corner by its direction, of several by their points."""

    TURN = math.radians(8.0)

    def __init__(self, pose: Pose) -> None:
        self.pose = pose

    @classmethod
    def from_estimate(cls, seen: Floats, known: Floats) -> CornerModel:
        """Fit corners ``(k, 9)``."""
        if len(seen) > 1 and np.ptp(seen[:, :2], axis=0).max() > 0.5:
            return cls(fit_points(seen[:, :2], known[:, :2]))
        theta = float(headings(Matches(seen[:1], known[:1]))[0])
        c, s = math.cos(theta), math.sin(theta)
        x, y = seen[0, :2]
        return cls((known[0, 0] - c * x + s * y, known[0, 1] - s * x - c * y, theta))

    def residuals(self, seen: Floats, known: Floats) -> Floats:
        """Return distances in metres, endless where the heading is off."""
        c, s = math.cos(self.pose[2]), math.sin(self.pose[2])
        x = c * seen[:, 0] - s * seen[:, 1] + self.pose[0] - known[:, 0]
        y = s * seen[:, 0] + c * seen[:, 1] + self.pose[1] - known[:, 1]
        off = np.abs(np.mod(known[:, 2] - seen[:, 2] - self.pose[2] + math.pi, math.tau) - math.pi)
        return np.hypot(x, y) + np.where(off > self.TURN, 1e6, 0.0)


@dataclass(frozen=True)
class ScikitImage(OfCorners):
    """scikit-image's `ransac` with a model that one matched corner fixes."""

    options: CornerOptions = field(default_factory=lambda: CornerOptions(headings=0))
    threshold: float = 0.2
    trials: int = 1000

    def __post_init__(self) -> None:
        from skimage.measure import ransac

        object.__setattr__(self, "ransac", ransac)

    def solve(self, matches: Matches) -> Pose | None:
        """Run it."""
        ransac: Any = self.ransac  # type: ignore[attr-defined]
        model, _ = ransac(
            (matches.seen, matches.known),
            CornerModel,
            min_samples=1,
            residual_threshold=self.threshold,
            max_trials=self.trials,
            stop_probability=0.999,
            rng=0,
        )
        return None if model is None else model.pose


@dataclass(frozen=True)
class Clipper(OfCorners):
    """CLIPPER on matched corners; two agree by their distance, their headings and the bearing between them.

    Its `clipperpy` is on no package index; who builds it from its authors' source gets its figures too.
    """

    options: CornerOptions = field(default_factory=lambda: CornerOptions(most=1000))
    reach: float = 0.08
    twist: float = 3.0

    def __post_init__(self) -> None:
        import clipperpy

        object.__setattr__(self, "clipperpy", clipperpy)

    def solve(self, matches: Matches) -> Pose | None:
        """Find the densest set of correspondences that agree, then fit them."""
        clipperpy: Any = self.clipperpy  # type: ignore[attr-defined]
        seen, a = np.unique(matches.seen, axis=0, return_inverse=True)
        known, b = np.unique(matches.known, axis=0, return_inverse=True)
        pairs = np.stack([a.ravel(), b.ravel()], axis=1)
        agree = affinities(seen, known, pairs, np.array([self.reach, math.radians(self.twist)]))
        solver = clipperpy.CLIPPER(
            clipperpy.invariants.EuclideanDistance(clipperpy.invariants.EuclideanDistanceParams()), clipperpy.Params()
        )
        solver.set_parallelize(False)
        solver.set_matrix_data(np.asfortranarray(agree), np.asfortranarray(agree > 0.0, dtype=np.float64))
        solver.solve()
        rows = np.array(solver.get_solution().nodes, dtype=np.int64)
        return fit_points(matches.seen[rows, :2], matches.known[rows, :2]) if len(rows) >= 2 else None


@dataclass(frozen=True)
class SmallGicp:
    """small_gicp from the guess: points along the segments, drawn up into walls; a wide round, then a narrow one."""

    spacing: float = 0.1
    rounds: tuple[float, ...] = (1.0, 0.3)
    kind: str = "PLANE_ICP"
    LAYERS = np.array([0.0, 0.1, 0.2])

    def __post_init__(self) -> None:
        import small_gicp

        object.__setattr__(self, "small_gicp", small_gicp)

    def _cloud(self, segments: Floats) -> tuple[Any, Any]:
        module: Any = self.small_gicp  # type: ignore[attr-defined]
        points = []
        for ends in segments:
            count = max(2, math.ceil(math.hypot(*(ends[2:] - ends[:2])) / self.spacing))
            points.append(np.linspace(ends[:2], ends[2:], count))
        flat = np.vstack(points)
        walls = np.hstack([np.tile(flat, (len(self.LAYERS), 1)), np.repeat(self.LAYERS, len(flat))[:, None]])
        cloud = module.PointCloud(np.ascontiguousarray(walls))
        tree = module.KdTree(cloud, num_threads=1)
        module.estimate_normals_covariances(cloud, tree, num_neighbors=9, num_threads=1)
        return cloud, tree

    def prepare(self, segments: Floats) -> tuple[Any, Any]:
        """Draw the map's points, their normals and their tree."""
        return self._cloud(segments)

    def locate(self, prepared: tuple[Any, Any], query: PeerQuery) -> Answer:
        """Align from the guess."""
        module: Any = self.small_gicp  # type: ignore[attr-defined]
        source, _ = self._cloud(query.scan)
        m = _matrix(query.guess)
        for reach in self.rounds:
            m = module.align(prepared[0], source, prepared[1], m, registration_type=self.kind,
                             max_correspondence_distance=reach, num_threads=1, max_iterations=30,
                             ).T_target_source  # fmt: skip
        return Answer((float(m[0, 3]), float(m[1, 3]), math.atan2(m[1, 0], m[0, 0])))


def _matrix(pose: RigidTransform) -> Floats:
    m = np.eye(4)
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    m[:2, :2], m[:2, 3] = [[c, -s], [s, c]], [pose.x, pose.y]
    return m


@dataclass(frozen=True, slots=True)
class Entry:
    """A peer's name in the tables, the module that it needs, how it is made, and whether it starts from the guess."""

    name: str
    module: str
    make: Callable[..., Peer]
    local: bool = False

    @property
    def installed(self) -> bool:
        """Return whether its module can be found."""
        return importlib.util.find_spec(self.module) is not None


PEERS: dict[str, Entry] = {
    "linefix": Entry("Linefix", "association", Linefix),
    "kiss": Entry("KISS-Matcher", "kiss_matcher", KissMatcher),
    "opencv": Entry("OpenCV", "cv2", OpenCv),
    "open3d": Entry("Open3D", "open3d", Open3d),
    "skimage": Entry("scikit-image", "skimage", ScikitImage),
    "clipper": Entry("CLIPPER", "clipperpy", Clipper),
    "guided": Entry("Linefix, guess", "association", functools.partial(Linefix, guided=True), local=True),
    "gicp": Entry("small_gicp, guess", "small_gicp", SmallGicp, local=True),
}
