"""Whose poses are told of a log: the robot's where it is known how its laser is mounted, else the laser's."""

from __future__ import annotations

import math
from dataclasses import dataclass

from registration import RigidTransform

from .errors import RefusedError, WrongUseError
from .logs import ReplayedScan
from .service import Json

ROBOT = "base_link"  # what a robot is called whose mount is given


@dataclass(slots=True)
class Frames:
    """Takes poses from the laser to the robot.

    Attributes
    ----------
    given : RigidTransform or None
        base_from_laser, as the user says; goes before what the log says.
    name : str
        Of the frame whose poses are told; empty before the first.
    of_laser : bool
        Whether that is the laser's.
    told : str
        Whose poses are told and why, for people.
    """

    given: RigidTransform | None
    name: str = ""
    of_laser: bool = False
    told: str = "none"

    @classmethod
    def of(cls, mount: tuple[float, float, float] | None) -> Frames:
        """Read the option ``--mount``; raises `WrongUseError` where it is no pose."""
        if mount is None:
            return cls(None)
        if not all(math.isfinite(value) for value in mount):
            raise WrongUseError("--mount: expected x and y in metres, and theta in radians")
        return cls(RigidTransform(*mount))

    def answer(self, one: ReplayedScan, answer: Json) -> Json | RefusedError:
        """Return an answer with the pose and the covariance of the robot, of the laser where its mount is not known.

        What the first scan says holds for all: one without a mount among others is not taken.
        """
        mount = self.given or one.mount
        if not self.name:
            self._decide(one, mount)
        if self.of_laser:
            return answer
        if mount is None:
            return RefusedError(f"the log does not say where {one.frame} was on the robot then")
        found = answer["pose"]
        if found is None:
            return answer
        laser, by = RigidTransform(found["x"], found["y"], found["theta"]), mount.inverse()
        robot = laser.compose(by)
        covariance = answer["covariance"]
        return {
            **answer,
            "pose": {"x": robot.x, "y": robot.y, "theta": robot.theta},
            "covariance": None if covariance is None else laser.carry(covariance, by).tolist(),
        }

    def _decide(self, one: ReplayedScan, mount: RigidTransform | None) -> None:
        if mount is None:
            self.name, self.of_laser = one.frame or "laser", True
            self.told = f"of {self.name}, the laser; --mount X Y THETA would give those of the robot"
            return
        self.name = ROBOT if self.given is not None else one.base
        by = "as --mount says" if self.given is not None else "as the log says"
        where = f"({mount.x:.3f}, {mount.y:.3f}) m, {math.degrees(mount.theta):.1f} degrees"
        self.told = f"of {self.name}, the robot, with {one.frame} mounted at {where}, {by}"
