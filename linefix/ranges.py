"""Ranges of scanners on a robot to views of the search: the one place where mount and motion count."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from association import AssociationWarning, Scan, View, mirrored
from registration import IDENTITY, RigidTransform
from vectorization import LaserScan, VectorizationOptions, vectorize
from vectorization.laser import LONGEST_SCAN, USUAL_SCAN

# Standard deviations of the speed of a robot whose motion is not known, m/s and rad/s: default limits of Nav2's
# controllers.
SPEED, TURN = 0.5, 1.0


@runtime_checkable
class MountedScan(Protocol):
    """Ranges, and how their scanner was mounted; such as `formats.LoggedScan`.

    Attributes
    ----------
    laser : LaserScan
        In the sensor's frame; with its `motion` where that is known.
    time_increment : float
        From beam to beam, seconds; 0: not known, the scan is taken for one of a moment. One by which the scan takes
        more than 1 s is in another unit: 0.2 s are assumed.
    mount : RigidTransform or None
        base_from_sensor; None: not known, poses are those of the sensor.
    flipped : bool
        True: the sensor is mounted upside down, y becomes -y in its data before `mount` applies.

    The answer has its `located_frame` and its `stamp`, if it has such attributes.
    """

    @property
    def laser(self) -> LaserScan:
        """Return the ranges."""

    @property
    def time_increment(self) -> float:
        """Return the seconds from beam to beam."""

    @property
    def mount(self) -> RigidTransform | None:
        """Return base_from_sensor."""

    @property
    def flipped(self) -> bool:
        """Return whether the sensor is upside down."""


@dataclass(frozen=True, slots=True, eq=False)
class RangeScan:
    """The plainest `MountedScan`; its attributes are those."""

    laser: LaserScan
    time_increment: float = 0.0
    mount: RigidTransform | None = None
    flipped: bool = False


def view_of(seen: MountedScan, base_from_then: RigidTransform = IDENTITY, sigma: float | None = None) -> View:
    """Return the view of a mounted scanner, in the frame of the robot; of the sensor where its mount is not known.

    Parameters
    ----------
    seen : MountedScan
    base_from_then : RigidTransform
        Pose of the robot at the time of the first beam, in the frame whose pose is located.
    sigma : float, optional
        Of single ranges, metres; None: estimated.

    Returns
    -------
    View
        Several of them, put together by `assemble`, are one scan. If the scanner's motion during the scan is not
        known, it has the error and the warning for that. Scanners of one robot share its motion, so this error is
        common to all views, each with its own lever arm.

    Raises
    ------
    InputError
        When the ranges are no scan.

    Examples
    --------
    A scan of a log, and one of a second scanner that was taken when the robot had driven on by 5 cm:

    >>> import linefix
    >>> from formats import LoggedScan
    >>> laser = linefix.LaserScan(-1.0, 0.1, [2.0] * 21)
    >>> front = LoggedScan(0, "/front", "front", laser, mount=linefix.RigidTransform(0.3, 0.0, 0.0))
    >>> rear = LoggedScan(0, "/rear", "rear", laser, mount=linefix.RigidTransform(-0.3, 0.0, 3.14))
    >>> step = linefix.RigidTransform(0.05, 0.0, 0.0)
    >>> views = [linefix.view_of(front), linefix.view_of(rear, step)]
    >>> [round(view.pose.x, 2) for view in views]
    [0.3, -0.25]
    >>> scan = linefix.assemble(views)
    """
    scan, warning = ranges_scan(seen.laser, sigma), motion_warning(seen)
    if warning is not None:
        scan = replace(scan, warnings=(*scan.warnings, warning), sweep_s=_seconds_moving(seen))
    place = base_from_then.compose(seen.mount or IDENTITY)
    shown = mirrored(scan) if seen.flipped else scan
    return View(shown, place, motion=_motion_root(seen, base_from_then))


def _motion_root(seen: MountedScan, base_from_then: RigidTransform = IDENTITY) -> NDArray[np.float64] | None:
    """Return the error of a scanner's place by its motion during the scan, per variate; None if the motion is known.

    On average the beams are taken half the duration after the first one. A robot moves by ``v`` and ``omega``
    meanwhile, and a sensor at ``r`` by ``v + omega x r``.

    Parameters
    ----------
    seen : MountedScan
    base_from_then : RigidTransform
        As of `view_of`.

    Returns
    -------
    (3, 3) or None
        Additive (x, y, theta) of the view's pose, metres and radians; by columns for one standard deviation of the
        robot's forward speed, sideward speed and turn rate.
    """
    seconds = _seconds_moving(seen)
    if not seconds:
        return None
    place = base_from_then.compose(seen.mount or IDENTITY)
    x, y = place.x - base_from_then.x, place.y - base_from_then.y
    c, s = math.cos(base_from_then.theta), math.sin(base_from_then.theta)
    moved = 0.5 * seconds * np.array([[c, -s, -y], [s, c, x], [0.0, 0.0, 1.0]])
    root: NDArray[np.float64] = moved * np.array([SPEED, SPEED, TURN])
    return root


def motion_warning(seen: MountedScan) -> AssociationWarning | None:
    """Return the warning about a scanner that may have moved during the scan; None where its motion is known."""
    seconds = _seconds_moving(seen)
    if not seconds:
        return None
    beams, increment = len(seen.laser.ranges), seen.time_increment
    told = f"By its time_increment of {increment:.3g} s a scan of {beams} beams takes {increment * beams:.3g} s"
    if seconds < increment * beams:
        told += f", expected at most {LONGEST_SCAN:g} s, so {seconds:g} s is assumed; give time_increment in seconds"
    return AssociationWarning(
        "motion_unknown",
        f"{told}. The motion of the sensor during this time is unknown, so the scan may be distorted. The covariance "
        f"allows for {SPEED:g} m/s, and for the rotation that the walls allow. Send the motion: over HTTP as "
        "`twist`, 0 for a sensor at rest; in a log and in ROS 2 as odometry.",
    )


def _seconds_moving(seen: MountedScan) -> float:
    """Return the duration of a scan during which the motion of its sensor is not known; 0 where it is known."""
    if not seen.time_increment > 0.0 or seen.laser.motion is not None:
        return 0.0
    seconds = seen.time_increment * len(seen.laser.ranges)
    return seconds if seconds <= LONGEST_SCAN else USUAL_SCAN


def ranges_scan(scan: LaserScan | ArrayLike, sigma: float | None = None) -> Scan:
    """Return ranges, or points in scanning order, as a scan: segments, and the single beams as evidence.

    Parameters
    ----------
    scan : LaserScan, or array-like of shape (m, 2)
        Metres in the sensor's frame.
    sigma : float, optional
        Of single ranges, metres; None: estimated.

    Raises
    ------
    InputError
        When it is no scan.
    """
    found = vectorize(scan, VectorizationOptions(sigma=sigma))
    beyond = scan.beyond_limits if isinstance(scan, LaserScan) else None
    warnings = () if beyond is None else (AssociationWarning("no_segments", f"No range is {beyond}."),)
    told = 0.0 if isinstance(scan, LaserScan) and scan.motion is not None else None
    return Scan(found.measured, found.viewpoint, found.beams, None, found.ordered, warnings, told)
