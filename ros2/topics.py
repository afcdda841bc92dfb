"""The topics of the node: its subscriptions and its publications."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from cyclonedds.domain import DomainParticipant
from cyclonedds.qos import Qos

from . import messages as ros
from .options import NodeOptions
from .wire import LATCHED, NEWEST, RELIABLE, STREAM, Message, Publisher, Subscription, undecodable

LEFT_OUT = 50  # messages of other robots that are stored for a hint


@dataclass(frozen=True, slots=True)
class Transforms:
    """A topic of transforms.

    Attributes
    ----------
    subscription : Subscription of ros.SerializedTransforms
    static : bool
    prefix : str
        Of the robot's frames, where other robots publish on this topic as well; empty: all frames are its own.
    left_out : deque of bytes
        Messages without a frame that has the prefix, the newest.
    """

    subscription: Subscription[ros.SerializedTransforms]
    static: bool
    prefix: str

    left_out: deque[bytes] = field(default_factory=lambda: deque(maxlen=LEFT_OUT))

    def take(self) -> Sequence[ros.TFMessage]:
        """Return the messages that came, those of other robots left out before they are decoded."""
        own = self.prefix.encode()
        found = []
        for message in self.subscription.take():
            if own not in message.serialized:
                self.left_out.append(message.serialized)
                continue
            try:
                found.append(ros.TFMessage.deserialize(message.serialized))
            except Exception as error:  # whatever decoding raises for bytes that are no such message
                self.subscription.problem(f"{self.subscription.name}: {undecodable(ros.TFMessage, error)}")
        return found

    @property
    def lossy(self) -> bool:
        """Return whether transforms that were published once may be lost."""
        return self.static and self.subscription.writers.best_effort


class Topics:
    """All topics of one robot.

    Parameters
    ----------
    participant : DomainParticipant
    options : NodeOptions
    problem : callable
        Called with a sentence for each message that cannot be decoded.
    """

    def __init__(self, participant: DomainParticipant, options: NodeOptions, problem: Callable[[str], None]) -> None:
        self.subscriptions: list[Subscription[Any]] = []

        def subscribe(name: str, kind: type[Message], *profiles: Qos) -> Subscription[Message]:
            found = Subscription(participant, options.topic(name), kind, *profiles, problem=problem)
            self.subscriptions.append(found)
            return found

        def publish(name: str, kind: type[Message], profile: Qos) -> Publisher[Message]:
            return Publisher(participant, options.topic(name), kind, profile)

        self.scans = [subscribe(name, ros.LaserScan, STREAM) for name in options.scans]  # lasers may share a topic
        self.odometry = subscribe(options.odom, ros.Odometry, STREAM)
        self.maps = [subscribe(options.map_topic, ros.SerializedGrid, LATCHED, RELIABLE)] if options.map_topic else []
        above = [("/", options.prefix), *([("", "")] if options.namespace else [])]
        self.transforms = [
            Transforms(subscribe(f"{start}{name}", ros.SerializedTransforms, *profiles), static, prefix)
            for start, prefix in above
            for name, static, profiles in (("tf_static", True, (LATCHED, RELIABLE, STREAM)), ("tf", False, (STREAM,)))
        ]
        self.clock = subscribe("/clock", ros.Clock, STREAM) if options.use_sim_time else None
        self.requests = subscribe("linefix/locate", ros.Empty, RELIABLE)
        self.named_requests = subscribe("linefix/locate_request", ros.String, RELIABLE)
        self.amcl = subscribe("amcl_pose", ros.PoseWithCovarianceStamped, LATCHED, RELIABLE)
        self.initial = publish("initialpose", ros.PoseWithCovarianceStamped, RELIABLE)
        self.pose = publish("linefix/pose", ros.PoseWithCovarianceStamped, RELIABLE)
        self.agreed = publish("linefix/agreed_pose", ros.PoseWithCovarianceStamped, RELIABLE)
        # On a topic of its own: behind robots the map would be no longer latched.
        self.walls = publish("linefix/map_markers", ros.MarkerArray, NEWEST)
        self.markers = publish("linefix/markers", ros.MarkerArray, NEWEST)
        self.map_id = publish("linefix/map_id", ros.String, NEWEST)
        self.status = publish("linefix/status", ros.DiagnosticStatus, NEWEST)
        self.results = publish("linefix/locate_result", ros.DiagnosticStatus, LATCHED)
        self.diagnostics = publish("/diagnostics", ros.DiagnosticArray, RELIABLE)
        name = "tf" if options.namespace and not options.frame_prefix else "/tf"
        self.tf = publish(name, ros.TFMessage, RELIABLE) if options.publish_tf else None

    def unprefixed(self, frame: str) -> str:
        """Return the topic on which transforms of a frame come without the prefix of the robot; empty if on none."""
        sought = frame.encode() + b"\0"
        found = (one.subscription.name for one in self.transforms if any(sought in each for each in one.left_out))
        return next(found, "")
