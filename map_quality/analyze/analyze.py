"""Localization at a place: a scan is simulated there and searched in the map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest

import numpy as np

from association import AssociationOptions, AssociationResult, Deadline, MapIndex, Scan, Status, associate
from registration import RigidTransform, Segments

from ..views import AnalysisError, Robot, Steps, is_elsewhere, is_same, look, similar_pose
from .drive import STEP, seen_on_the_way, ways_from
from .standing import CLEARANCE, Standing, is_free, standing_places

MOST_DRIVE = 30.0  # m


@dataclass(frozen=True, slots=True)
class PlaceVerdict:
    """Result of localization at a place.

    Attributes
    ----------
    number : int
        Of the pose in `Standing.poses`.
    pose : RigidTransform
        The true pose, map_from_scan.
    status : Status
        Of the answer; ambiguous where that is another place, however sure the search was.
    usable : bool
        True when the answer was usable and is this place.
    probability : float or None
        As answered, 0 to 1; None where the position stays free along a direction.
    similar_pose : RigidTransform or None
        Another place that explains the scan about as well, or was taken for this one.
    unobservable : (float, float) or None
        Along which the position stays free; a unit vector in the map frame.
    reasons : tuple of str
        Codes of why it is not usable, the weightiest first.
    resolved_after : float or None
        Metres until the robot's pose is resolved, on the better of the two ways of `map_quality.analyze.drive`. 0 where
        it is resolved at once; None where it is not within the requested drive, or none was requested.
    with_landmark : PlaceVerdict or None
        The result with the landmark; None where there is none, or it stands in the way.
    """

    number: int
    pose: RigidTransform
    status: Status
    usable: bool
    probability: float | None
    similar_pose: RigidTransform | None
    unobservable: tuple[float, float] | None
    reasons: tuple[str, ...]
    resolved_after: float | None = None
    with_landmark: PlaceVerdict | None = None


@dataclass(frozen=True, slots=True)
class Analysis:
    """A map that is gone over; shared between threads.

    Attributes
    ----------
    index : MapIndex
        The index in which scans are searched.
    segments : Segments
        The map as sent; the scanner also sees the points of the index.
    robot : Robot
    standing : Standing
    seed : int
        Of the noise.
    drive : float
        Longest drive of the robot from a place where its pose is not resolved, metres; 0: no drive.
    landmark : Analysis or None
        The same of a map with the landmark.
    """

    index: MapIndex
    segments: Segments
    robot: Robot
    standing: Standing
    seed: int = 0
    drive: float = 0.0
    landmark: Analysis | None = None

    @classmethod
    def over(
        cls,
        index: MapIndex,
        robot: Robot,
        spacing: float | None = None,
        point: Sequence[float] | None = None,
        *,
        seed: int = 0,
        drive: float = 0.0,
        landmark: Segments | None = None,
    ) -> Analysis:
        """Lay a grid of poses over a map.

        Parameters
        ----------
        index : MapIndex
            Directions count as they do in the index.
        robot : Robot
        spacing, point
            As of `standing_places`.
        seed, drive
            As of `Analysis`; metres to drive from 0 to 30.
        landmark : Segments, optional
            As of `with_segments`.

        Raises
        ------
        AnalysisError
            When the places cannot be had, or the drive is out of range.
        """
        if not 0.0 <= drive <= MOST_DRIVE:
            raise AnalysisError(f"expected from 0 to {MOST_DRIVE:g} m, found {drive:g}", argument="drive")
        # Of a map without directions the index holds each segment twice.
        segments = Segments.derived(index.segments.endpoints[: index.directed])
        standing = standing_places(segments, robot, spacing, point)
        analysis = cls(index, segments, robot, standing, seed, drive)
        return analysis if landmark is None or not len(landmark) else analysis.with_segments(landmark)

    def with_segments(self, landmark: Segments) -> Analysis:
        """Return the same analysis with a second one that has more segments, on the map and in the building.

        Parameters
        ----------
        landmark : Segments
            In the map frame; such as a box, its free side outside.
        """
        ends = np.vstack([self.segments.endpoints, landmark.endpoints])
        segments = Segments.derived(ends)
        index = MapIndex.build(segments, self.index.sigma, oriented=self.index.oriented, points=self.index.points)
        return replace(self, landmark=replace(self, index=index, segments=segments, drive=0.0, landmark=None))

    def looking(self, number: int, deadline: Deadline | None = None) -> Steps[PlaceVerdict | None]:
        """Take a scan at one of the poses and search it, one search at a step; None where a robot cannot stand there.

        Raises
        ------
        CancelledError
            When the deadline was cancelled.
        """
        pose = self.standing.pose(number)
        points_away = np.hypot(*(self.index.points.positions - [pose.x, pose.y]).T) >= CLEARANCE
        free = is_free(self.segments, pose, self.robot.range_max, oriented=self.index.oriented)
        if not (free and points_away.all()):
            return None
        seen = self._scan(pose, number)
        result = self._search(seen, deadline)
        mistaken = is_elsewhere(result, pose)
        found = PlaceVerdict(
            number=number,
            pose=pose,
            status=Status.AMBIGUOUS if mistaken else result.status,
            usable=result.usable and not mistaken,
            probability=result.probability,
            similar_pose=similar_pose(result, pose),
            unobservable=result.unobservable,
            reasons=("similar_place",) if mistaken else tuple(reason.code for reason in result.reasons),
        )
        if self.drive:
            metres = 0.0 if found.usable else (yield from self._knows_after(number, pose, seen, deadline))
            found = replace(found, resolved_after=metres)
        if self.landmark is not None:
            yield
            found = replace(found, with_landmark=(yield from self.landmark.looking(number, deadline)))
        return found

    def _search(self, seen: Scan, deadline: Deadline | None) -> AssociationResult:
        return associate(self.index, seen, None, AssociationOptions(oriented=self.index.oriented, on_map=1.0), deadline)

    def _knows_after(
        self, number: int, pose: RigidTransform, seen: Scan, deadline: Deadline | None
    ) -> Steps[float | None]:
        """Return how far it drives until the scans so far give a usable answer that is right; metres."""
        ways = ways_from(self.segments, pose, self.drive, self.robot.range_max)
        seen_so_far = [[(pose, seen)] for _ in ways]
        for step in zip_longest(*ways):
            for way, (there, views) in enumerate(zip(step, seen_so_far, strict=True)):
                if there is None:
                    continue
                if deadline is not None and deadline.passed:
                    return None
                yield
                views.append((there, self._scan(there, number, way, len(views))))
                result = self._search(seen_on_the_way(views, np.random.default_rng((self.seed, number))), deadline)
                if result.usable and result.pose is not None and is_same(result.pose, there):
                    return STEP * (len(views) - 1)
        return None

    def _scan(self, pose: RigidTransform, *number: int) -> Scan:
        """Return the scan that the robot would send from there; the noise of a place is the same on each attempt."""
        arms = self.index.points.arms()
        seen = Segments.derived(np.vstack([self.segments.endpoints, arms])) if len(arms) else self.segments
        return look(seen, pose, self.robot, np.random.default_rng((self.seed, *number))).scan
