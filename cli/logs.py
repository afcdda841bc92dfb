"""Logs of other tools: their scans; and a robot along a log: whose poses are located, and the prior by odometry."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from .errors import RefusedError, WrongUseError, needing
from .inputs import existing
from .options import TopicOptions
from .printing import Json, noted, print_lines, rows

if TYPE_CHECKING:
    from formats import Log, LoggedScan
    from registration import RigidTransform

ROBOT = "base_link"  # name of the robot's frame where the user sets the mount
LOST = 5.0  # m; a prior wider than this is dropped
FASTEST, FASTEST_TURN = 1.0, 1.0  # m/s and rad/s; deviations of a motion that odometry does not show


def opened(path: Path, source: TopicOptions, mount: RigidTransform | None = None) -> Log:
    """Open a log.

    Raises
    ------
    WrongUseError
        When there is no such file.
    RefusedError
        When it cannot be read.
    """
    with needing(f"reading {existing(path).name}"):
        from formats import LogOptions, read_log

        return read_log(path, LogOptions(source.topic, source.odom, source.tf_namespace, mount, source.base))


def mount_of(given: tuple[float, float, float] | None) -> RigidTransform | None:
    """Return a mount that a user states; raises `WrongUseError` where it is no pose."""
    from registration import RigidTransform

    try:
        return None if given is None else RigidTransform(*given)
    except ValueError as error:
        raise WrongUseError(f"--mount: {error}") from error


def scans_of(log: Log) -> Iterator[LoggedScan]:
    """Yield the scans of a log; raises `RefusedError` where it is broken."""
    with needing(f"reading {log.name}"):
        yield from log


def some_scans(path: Path, most: int, source: TopicOptions) -> list[LoggedScan]:
    """Return some scans of a log, evenly over all of it; print on stderr what was made of the log; raises as above."""
    log = opened(path, source)
    from formats import thinned

    taken, _ = thinned(scans_of(log), most)
    print_notes(log, sys.stderr)
    return taken


def print_notes(log: Log, where: TextIO) -> None:
    """Print the assumptions about a log, and its parts that were left out."""
    report = asdict(log.report)
    print_lines(rows(((kind, noted(one)) for kind in ("assumed", "dropped") for one in report[kind]), 10), where)


@dataclass(slots=True)
class Frames:
    """Decides whose poses are located: the first scan decides for all.

    Attributes
    ----------
    given : RigidTransform or None
        base_from_laser, as the user states it; goes before the mount in the log.
    first : LoggedScan or None
        With the mount that counts; None before it is taken.
    """

    given: RigidTransform | None
    first: LoggedScan | None = None

    def taken(self, one: LoggedScan) -> LoggedScan:
        """Return a scan with the mount that counts; none where poses are those of the laser.

        Raises
        ------
        RefusedError
            When it has no mount, though the first has one.
        """
        if self.given is not None:
            one = replace(one, mount=self.given, base_frame=ROBOT)
        self.first = self.first or one
        if self.first.mount is not None and one.mount is None:
            raise RefusedError(
                f"the log has no mount of {one.frame_id} at this time, expected one as for the other scans; set --mount"
            )
        return one if self.first.mount is not None else replace(one, mount=None)

    @property
    def told(self) -> str:
        """The frame whose poses are reported and the reason, for people."""
        first = self.first
        if first is None:
            return "none"
        if first.mount is None:
            return f"of the laser (frame {first.located_frame}); set --mount X Y THETA for those of the robot"
        way, by = "upside down " if first.flipped else "", "the log" if self.given is None else "--mount"
        where = f"({first.mount.x:.3f}, {first.mount.y:.3f}) m, {math.degrees(first.mount.theta):.1f} degrees"
        return f"of the robot (frame {first.located_frame}), with {first.frame_id} mounted {way}at {where}, from {by}"


def odometry_of(one: LoggedScan) -> RigidTransform | None:
    """Return where odometry has the frame whose pose is located; None where it is not known."""
    if one.pose is None or one.mount is None:
        return one.pose
    return one.pose.compose(one.mount.inverse())


@dataclass(slots=True)
class Tracker:
    """Follows the last usable pose by odometry.

    A prior is weighed against the scan and never fused with it, so that a wrong one shows: where an answer contradicts
    it everything is forgotten, and the next scan is looked for all over the map.
    """

    _pose: RigidTransform | None = None
    _odometry: RigidTransform | None = None  # when that pose was found
    _last: LoggedScan | None = None  # the last scan of which odometry is known
    _driven: float = 0.0
    _turned: float = 0.0
    _unknown: float = 0.0  # s without odometry
    map_id: str | None = None  # of several maps the one that the last usable pose is on

    def prior(self, scan: LoggedScan) -> Json | None:
        """Return the prior of the next scan's pose, None without one."""
        odometry, last = odometry_of(scan), self._last
        if odometry is None:
            return None
        before = None if last is None else odometry_of(last)
        if last is None or before is None or last.part != scan.part:
            self._pose = None
        else:
            step = before.inverse().compose(odometry)
            self._driven += math.hypot(step.x, step.y)
            self._turned += abs(step.theta)
            self._unknown += scan.unknown_s - last.unknown_s
        self._last = scan
        if self._pose is None or self._odometry is None:
            return None
        from map_quality.update.odometry import odometry_deviations

        sigma, angle = odometry_deviations(self._driven, self._turned)
        sigma, angle = sigma + FASTEST * self._unknown, angle + FASTEST_TURN * self._unknown
        if sigma > LOST:
            return None
        here = self._pose.compose(self._odometry.inverse().compose(odometry))
        covariance = [[sigma**2, 0.0, 0.0], [0.0, sigma**2, 0.0], [0.0, 0.0, angle**2]]
        prior: Json = {"x": here.x, "y": here.y, "theta": here.theta, "covariance": covariance}
        return prior if self.map_id is None else {**prior, "map_id": self.map_id}

    def learn(self, answer: Json, scan: LoggedScan) -> None:
        """Update the last usable pose with the answer to that scan."""
        odometry = odometry_of(scan)
        if any(one["code"] == "prior_contradicted" for one in answer["warnings"]):
            self._pose = None
        elif answer["usable"] and odometry is not None:
            self._pose, self._odometry, self.map_id = pose_of(answer), odometry, map_of(answer)
            self._driven = self._turned = self._unknown = 0.0


def pose_of(answer: Json) -> RigidTransform | None:
    """Return the pose of an answer."""
    from registration import RigidTransform

    pose = answer["pose"]
    return None if pose is None else RigidTransform(pose["x"], pose["y"], pose["theta"])


def map_of(answer: Json) -> str | None:
    """Return of several maps the one that the pose is on."""
    return answer["map"]["map_id"] if "maps" in answer and answer["map"] else None
