"""Frame of the poses of a log: the robot's if the mount of its laser is known, else the laser's."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from .errors import RefusedError

if TYPE_CHECKING:
    from formats import LoggedScan
    from registration import RigidTransform

ROBOT = "base_link"  # name of the robot's frame where the user sets the mount


@dataclass(slots=True)
class Frames:
    """Decides whose poses are located.

    Attributes
    ----------
    given : RigidTransform or None
        base_from_laser, as the user states it; goes before the mount in the log.
    name : str
        Of the frame whose poses are reported; empty before the first.
    of_laser : bool
        True when that is the laser's.
    told : str
        The frame whose poses are reported and the reason, for people.
    """

    given: RigidTransform | None
    name: str = ""
    of_laser: bool = False
    told: str = "none"

    def taken(self, one: LoggedScan) -> LoggedScan:
        """Return a scan with the mount that counts; none where poses are those of the laser.

        The first scan decides for all.

        Raises
        ------
        RefusedError
            When it has no mount, though others do.
        """
        if self.given is not None:
            one = replace(one, mount=self.given, base_frame=ROBOT)
        if not self.name:
            self._decide(one)
        if self.of_laser:
            return replace(one, mount=None)
        if one.mount is None:
            raise RefusedError(
                f"the log has no mount of {one.frame_id} at this time, expected one as for the other scans; set --mount"
            )
        return one

    def _decide(self, one: LoggedScan) -> None:
        mount = one.mount
        if mount is None:
            self.name, self.of_laser = one.frame_id or "laser", True
            self.told = f"of the laser (frame {self.name}); set --mount X Y THETA for those of the robot"
            return
        self.name = one.base_frame
        by = "from --mount" if self.given is not None else "from the log"
        way = "upside down " if one.flipped else ""
        where = f"({mount.x:.3f}, {mount.y:.3f}) m, {math.degrees(mount.theta):.1f} degrees"
        self.told = f"of the robot (frame {self.name}), with {one.frame_id} mounted {way}at {where}, {by}"


def odometry_of(one: LoggedScan) -> RigidTransform | None:
    """Return where odometry has the frame whose pose is located; None where it is not known."""
    if one.pose is None or one.mount is None:
        return one.pose
    return one.pose.compose(one.mount.inverse())
