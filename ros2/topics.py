"""The topics of the node: its subscriptions and its publications."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from cyclonedds.domain import DomainParticipant

from .messages import (
    DiagnosticArray,
    DiagnosticStatus,
    Empty,
    LaserScan,
    MarkerArray,
    Odometry,
    PoseWithCovarianceStamped,
    SerializedGrid,
    SerializedTransforms,
    String,
    TFMessage,
)
from .options import NodeOptions
from .wire import LATCHED, NEWEST, RELIABLE, SENSOR, STREAM, Publisher, Subscription, undecodable


@dataclass(frozen=True, slots=True)
class Transforms:
    """A topic of transforms.

    Attributes
    ----------
    subscription : Subscription of SerializedTransforms
    static : bool
    prefix : str
        Of the robot's frames, where other robots publish on this topic as well; empty: all frames are its own.
    """

    subscription: Subscription[SerializedTransforms]
    static: bool
    prefix: str

    def take(self) -> Sequence[TFMessage]:
        """Return the messages that came, those of other robots left out before they are decoded."""
        own = self.prefix.encode()
        found = []
        for message in self.subscription.take():
            if own in message.serialized:
                try:
                    found.append(TFMessage.deserialize(message.serialized))
                except Exception as error:  # whatever decoding raises for bytes that are no such message
                    self.subscription.problem(f"{self.subscription.name}: {undecodable(TFMessage, error)}")
        return found


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
        def subscribe(name: str, kind: Any, *profiles: Any) -> Any:
            return Subscription(participant, options.topic(name), kind, *profiles, problem=problem)

        def publish(name: str, kind: Any, profile: Any) -> Any:
            return Publisher(participant, options.topic(name), kind, profile)

        self.scans: list[Subscription[LaserScan]] = [subscribe(name, LaserScan, SENSOR) for name in options.scans]
        self.odometry: Subscription[Odometry] = subscribe(options.odom, Odometry, STREAM)
        self.maps: list[Subscription[SerializedGrid]] = (
            [subscribe(options.map_topic, SerializedGrid, LATCHED, RELIABLE)] if options.map_topic else []
        )
        self.transforms = self._transforms(options, subscribe)
        self.requests: Subscription[Empty] = subscribe("linefix/locate", Empty, RELIABLE)
        self.named_requests: Subscription[String] = subscribe("linefix/locate_request", String, RELIABLE)
        self.amcl: Subscription[PoseWithCovarianceStamped] = subscribe(
            "amcl_pose", PoseWithCovarianceStamped, LATCHED, RELIABLE
        )
        self.initial: Publisher[PoseWithCovarianceStamped] = publish("initialpose", PoseWithCovarianceStamped, RELIABLE)
        self.pose: Publisher[PoseWithCovarianceStamped] = publish("linefix/pose", PoseWithCovarianceStamped, RELIABLE)
        self.agreed: Publisher[PoseWithCovarianceStamped] = publish(
            "linefix/agreed_pose", PoseWithCovarianceStamped, RELIABLE
        )
        # On a topic of its own: behind robots the map would be no longer latched.
        self.walls: Publisher[MarkerArray] = publish("linefix/map_markers", MarkerArray, NEWEST)
        self.markers: Publisher[MarkerArray] = publish("linefix/markers", MarkerArray, NEWEST)
        self.map_id: Publisher[String] = publish("linefix/map_id", String, NEWEST)
        self.status: Publisher[DiagnosticStatus] = publish("linefix/status", DiagnosticStatus, NEWEST)
        self.results: Publisher[DiagnosticStatus] = publish("linefix/locate_result", DiagnosticStatus, LATCHED)
        self.diagnostics: Publisher[DiagnosticArray] = publish("/diagnostics", DiagnosticArray, RELIABLE)
        name = "tf" if options.namespace and not options.frame_prefix else "/tf"
        self.tf: Publisher[TFMessage] | None = publish(name, TFMessage, RELIABLE) if options.publish_tf else None

    @staticmethod
    def _transforms(options: NodeOptions, subscribe: Callable[..., Any]) -> list[Transforms]:
        found = [
            Transforms(subscribe("/tf_static", SerializedTransforms, LATCHED, RELIABLE), True, options.prefix),
            Transforms(subscribe("/tf", SerializedTransforms, STREAM), False, options.prefix),
        ]
        if options.namespace:
            found.append(Transforms(subscribe("tf_static", SerializedTransforms, LATCHED, RELIABLE), True, ""))
            found.append(Transforms(subscribe("tf", SerializedTransforms, STREAM), False, ""))
        return found

    @property
    def subscriptions(self) -> list[Subscription[Any]]:
        """All that is subscribed to."""
        return [
            *self.scans, self.odometry, *self.maps, *(one.subscription for one in self.transforms),
            self.requests, self.named_requests, self.amcl,
        ]  # fmt: skip
