"""The robot of a node: topics, reports, the clock, and the frames and odometry that were received."""

from __future__ import annotations

from collections.abc import Callable, Collection

from cyclonedds.domain import DomainParticipant

from registration import IDENTITY, RigidTransform

from .clock import Clock
from .frames import FrameError, Frames, planar
from .health import Health
from .messages import Odometry
from .odometry import OdometryHistory
from .options import NodeOptions, quoted
from .topics import Topics


class Robot:
    """One robot.

    Parameters
    ----------
    participant : DomainParticipant
    options : NodeOptions
    log : callable
        Takes a line.

    Attributes
    ----------
    topics : Topics
    health : Health
    clock : Clock
    frames : Frames
    odometry : OdometryHistory
    """

    def __init__(self, participant: DomainParticipant, options: NodeOptions, log: Callable[[str], None]) -> None:
        self.options, self.clock, self.frames = options, Clock(simulated=options.use_sim_time), Frames()
        self.odometry = OdometryHistory(self.clock)
        self._undecodable: list[str] = []
        self.topics = Topics(participant, options, self._undecodable.append)
        name = options.namespace.strip("/")
        names = f"{name}/" if name else "", options.hardware_id or name
        self.health = Health(self.topics.diagnostics, self.topics.status, names, log)

    @property
    def odom_frame(self) -> str:
        """The odometry frame: as odometry names it, else that of the options."""
        return self.options.frame(self.odometry.frame or self.options.odom_frame)

    def take_clock(self) -> None:
        """Take the time of a simulation."""
        for message in self.topics.clock.take()[-1:] if self.topics.clock else ():
            self.clock.take(message)

    def take_transforms(self) -> None:
        """Take the transforms that came; they are odometry where no message of it comes."""
        frame = self.options.frame(self.options.odom_frame)
        for topic in self.topics.transforms:
            for message in topic.take():
                for problem in self.frames.take(message, static=topic.static, prefix=topic.prefix):
                    self.health.problem(f"{topic.subscription.name}: {problem}")
                newest = self.frames.newest(frame, self.options.base_of(frame))
                if newest is not None:
                    self.odometry.take_transform(*newest, frame)

    def take_odometry(self, maps: Collection[str]) -> None:
        """Take the odometry that came; `maps` are the frames of maps, in which it is none."""
        for message in self.topics.odometry.take():
            name, frame = self.topics.odometry.name, message.header.frame_id.strip("/")
            try:
                if frame in maps:
                    raise FrameError(
                        f"found odometry in {quoted(frame)}, the frame of the map, expected a frame of its own, such "
                        "as odom; choose another topic with --odom"
                    )
                self.odometry.take(message, self._child_from_base(message), name)
            except ValueError as error:  # those of the libraries are such, too
                self.health.problem(f"{name}: {error}", message.header.stamp)

    def report_undecodable(self) -> None:
        """Report the messages, of all topics, that could not be decoded."""
        for problem in self._undecodable:
            self.health.problem(problem)
        self._undecodable.clear()

    def _child_from_base(self, message: Odometry) -> RigidTransform:
        """Return where the base is in the child frame of odometry."""
        child = self.options.frame(message.child_frame_id)
        base = self.options.base_of(child)
        if child in ("", base):
            return IDENTITY
        matrix = self.frames.between(child, base)
        if matrix is None:
            raise FrameError(
                f"found odometry of {quoted(child)}, expected a transform from it to {quoted(base)}; publish one, "
                "or set the base frame with --base"
            )
        return planar(matrix)
