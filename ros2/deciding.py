"""Decisions: whether the localizer agrees, when ``initialpose`` is published, and the transform from the map."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from registration import RigidTransform, wrap_angle

from . import tuning
from .agreement import Observation
from .frames import FrameError, Frames, matrix_of, planar
from .messages import NS, PoseWithCovarianceStamped, nanoseconds
from .odometry import OdometryHistory
from .options import When
from .reporting import PLANAR, at_least
from .tuning import ALWAYS_SECONDS, CORRECTION_SPEED, CORRECTION_TURN_RATE, LOST_SECONDS, UNCONFIRMED_SECONDS

UNKNOWN = np.diag([1.0, 1.0, math.pi])  # covariance of a pose without a valid one


class Watch:
    """Compares poses with ``amcl_pose``, or with the transform from the map to the odometry frame.

    Parameters
    ----------
    frames : Frames
    odometry : OdometryHistory
    transforms : bool
        False where this node publishes the transform itself: it is not that of a localizer.
    """

    def __init__(self, frames: Frames, odometry: OdometryHistory, *, transforms: bool = True) -> None:
        self._frames, self._odometry, self._transforms = frames, odometry, transforms
        self._amcl: Observation | None = None
        self._against = 0

    @property
    def lost(self) -> bool:
        """Return whether the localizer disagreed with the last scans that confirmed the pose."""
        return self._against >= tuning.LOST_SCANS

    def reset(self) -> None:
        """Forget what was compared, as after a new pose was published."""
        self._against = 0

    def take(self, message: PoseWithCovarianceStamped) -> None:
        """Take a message of ``amcl_pose``.

        Raises
        ------
        FrameError
            When it is no pose, or its covariance is none: the pose then counts with a wide one.
        """
        pose = planar(matrix_of(message.pose.pose.position, message.pose.pose.orientation))
        covariance = np.reshape(np.asarray(message.pose.covariance, dtype=np.float64), (6, 6))[np.ix_(PLANAR, PLANAR)]
        valid = bool((np.abs(covariance) <= tuning.MAX_COVARIANCE).all())
        used = at_least(covariance, 0.0, 0.0) if valid else UNKNOWN
        self._amcl = Observation(nanoseconds(message.header.stamp), pose, used)
        if not valid:
            raise FrameError(f"found a covariance with {np.abs(covariance).max():g}; 1 m and 102 degrees are assumed")

    def compare(self, scan: Observation, map_frame: str, odom_frame: str) -> bool | None:
        """Return whether the localizer agrees with a scan that is agreed; None where it is not known.

        The result counts for `lost`.
        """
        estimate = self._at(scan, map_frame, odom_frame)
        if estimate is None:
            return None
        both = estimate.covariance + scan.covariance
        both = both + np.diag([tuning.LOCALIZER_SIGMA**2, tuning.LOCALIZER_SIGMA**2, tuning.LOCALIZER_SIGMA_THETA**2])
        agrees = estimate.pose.chi_square(scan.pose, both) <= tuning.AGREEING_CHI_SQUARE
        self._against = 0 if agrees else self._against + 1
        return agrees

    def _at(self, scan: Observation, map_frame: str, odom_frame: str) -> Observation | None:
        matrix = self._frames.lookup(map_frame, odom_frame, scan.stamp) if self._transforms else None
        if matrix is not None and scan.odometry is not None:
            pose = planar(matrix).compose(scan.odometry)
            return Observation(scan.stamp, pose) if self._amcl is None else replace(self._amcl, pose=pose)
        if self._amcl is None:
            return None
        step = self._odometry.between(self._amcl.stamp, scan.stamp)
        if step is None:
            return None
        carried = self._amcl.pose.carry(self._amcl.covariance, step)
        return replace(self._amcl, pose=self._amcl.pose.compose(step), covariance=carried)


@dataclass(slots=True)
class InitialPose:
    """Decides, scan by scan, whether the agreed pose is published.

    Attributes
    ----------
    when : "start", "lost" or "always"
    """

    when: When = "start"
    _wanted: bool = True
    _at: float | None = None  # when it was published last

    def want(self) -> None:
        """Publish the next agreed pose, after a request or a new subscription."""
        self._wanted = True

    def decide(self, *, new: bool, localizer_agrees: bool | None, lost: bool, now: float) -> str | None:
        """Return why the pose of a scan that is agreed is published; None where it is not.

        Parameters
        ----------
        new : bool
            True when it is the first scan of this pose.
        localizer_agrees : bool or None
            True when the localizer has this pose; None: not known.
        lost : bool
            True when it has had another one for some scans.
        now : float
            `time.monotonic()`, seconds.
        """
        if localizer_agrees and self.when != "always":
            self._wanted = False
            return None
        if self._wanted:
            return "agreed"
        if new and self._at is not None:
            return "corrected"  # the pose published before is contradicted
        since = LOST_SECONDS if self._at is None else now - self._at
        if lost and self.when != "start" and since >= LOST_SECONDS:
            return "lost"
        return "always" if self.when == "always" and since >= ALWAYS_SECONDS else None

    def published(self, *, subscribed: bool, now: float) -> None:
        """Note that the pose was published; without a subscriber it stays wanted."""
        self._wanted, self._at = not subscribed, now


@dataclass(slots=True)
class MapToOdom:
    """Follows the agreed poses; small corrections are spread over time, a newly agreed pose holds at once.

    Attributes
    ----------
    current : RigidTransform or None
        map_from_odom, as it is published; None before a pose is agreed.
    """

    current: RigidTransform | None = None
    _target: RigidTransform | None = None
    _scan: Observation = field(default_factory=lambda: Observation(0))  # the last one that was taken
    _stamp: int = 0

    def take(self, scan: Observation, *, new: bool) -> None:
        """Take a scan that is agreed, with `new` the first of its pose; one without odometry changes nothing."""
        if scan.odometry is None:
            return
        self._target = scan.pose.compose(scan.odometry.inverse())
        before, self._scan = self._scan, scan
        if new or self.current is None or (scan.part, scan.unknown_s) != (before.part, before.unknown_s):
            self.current, self._stamp = self._target, scan.stamp

    def advance(
        self, stamp: int, odometry: RigidTransform, part: tuple[int, ...] = (), unknown_s: float = 0.0
    ) -> RigidTransform | None:
        """Return map_from_odom at a time; None before a scan confirms odometry that jumped, or was not known for long.

        Parameters
        ----------
        stamp : int
            Nanoseconds.
        odometry : RigidTransform
            odom_from_base: the correction is limited where the robot is, not at the origin of odometry.
        part, unknown_s : tuple of int, float
            As of `Observation`.
        """
        doubtful = part != self._scan.part or unknown_s - self._scan.unknown_s > UNCONFIRMED_SECONDS
        if self.current is None or self._target is None or doubtful:
            return None
        seconds = min(1.0, max(0.0, (stamp - self._stamp) / NS))
        self._stamp = stamp
        here, there = self.current.compose(odometry), self._target.compose(odometry)
        distance, angle = math.hypot(there.x - here.x, there.y - here.y), wrap_angle(there.theta - here.theta)
        needed = max(distance / CORRECTION_SPEED, abs(angle) / CORRECTION_TURN_RATE)
        if needed <= seconds:
            self.current = self._target
        elif seconds > 0.0:
            done = seconds / needed
            mixed = RigidTransform(
                here.x + done * (there.x - here.x), here.y + done * (there.y - here.y), here.theta + done * angle
            )
            self.current = mixed.compose(odometry.inverse())
        return self.current
