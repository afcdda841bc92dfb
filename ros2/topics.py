"""The topics of the node over DDS: names, quality of service, readers and writers."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from cyclonedds.core import DDSException, GuardCondition, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.core import InstanceState as Instances
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from . import messages as ros
from .connecting import Endpoints
from .options import NodeOptions

Message = TypeVar("Message", bound=IdlStruct)

MOST = 200  # messages that are taken from a reader at a time

# The sensor data profile of ROS: only the newest message counts.
SENSOR = Qos(Policy.Reliability.BestEffort, Policy.Durability.Volatile, Policy.History.KeepLast(1))
# For streams of which each message counts, though some may be lost.
STREAM = Qos(Policy.Reliability.BestEffort, Policy.Durability.Volatile, Policy.History.KeepLast(100))
_ACKNOWLEDGED = Policy.Reliability.Reliable(duration(seconds=1))
# For messages that are published once and hold, also for subscribers that come later: maps and mounts.
LATCHED = Qos(_ACKNOWLEDGED, Policy.Durability.TransientLocal, Policy.History.KeepLast(10))
# For a state: only the newest counts, also for subscribers that come later.
NEWEST = Qos(_ACKNOWLEDGED, Policy.Durability.TransientLocal, Policy.History.KeepLast(1))
RELIABLE = Qos(_ACKNOWLEDGED, Policy.Durability.Volatile, Policy.History.KeepLast(10))


def topic_name(name: str) -> str:
    """Return the name in DDS of a topic of ROS: ``/scan`` is ``rt/scan``."""
    return f"rt/{name.strip('/')}"


class Subscription(Generic[Message]):
    """A subscription.

    Parameters
    ----------
    participant : DomainParticipant
    name : str
        Of the topic, as in ROS.
    kind : type
        Of the message.
    *profiles : Qos
        One reader for each. A topic that some robots publish transient local and others volatile needs two readers:
        one that requests transient local does not match a volatile writer, and a volatile one misses what was
        published before it came. Messages then come twice.
    problem : callable
        Called with a sentence for each message that cannot be decoded.

    Attributes
    ----------
    writers : Endpoints
        The publishers of others.
    """

    def __init__(
        self,
        participant: DomainParticipant,
        name: str,
        kind: type[Message],
        *profiles: Qos,
        problem: Callable[[str], None] = lambda _: None,
    ) -> None:
        topic: Any = Topic(participant, topic_name(name), kind)
        self.name, self.problem, self._kind = name, problem, kind
        self.readers: list[Any] = [DataReader(participant, topic, qos=profile) for profile in profiles]
        self.writers = Endpoints(participant, topic_name(name), profiles, writers=True)

    def take(self) -> Sequence[Message]:
        """Return the messages that came since the last call, oldest first, at most `MOST` of each reader."""
        return [message for reader in self.readers for message in self._taken(reader)]

    def report_undecodable(self, kind: type[IdlStruct], error: Exception) -> None:
        """Report a message whose bytes are not those of its type."""
        expected = f"expected a {kind.__name__}. Check the type that is published"
        self.problem(f"{self.name}: a message cannot be decoded and is ignored: {error}; {expected}")

    def _taken(self, reader: Any) -> list[Message]:
        found: list[Message] = []
        for _ in range(MOST):
            try:
                samples = reader.take(1)  # one at a time: an error in a message takes all that are taken with it
            except DDSException as error:
                self.problem(f"{self.name}: reading failed: {error}")
                break
            except Exception as error:  # whatever decoding raises for bytes that are no such message
                self.report_undecodable(self._kind, error)
                continue
            if not samples:
                break
            found += [sample for sample in samples if isinstance(sample, IdlStruct)]  # not that a writer has gone
        return found


class Publisher(Generic[Message]):
    """A publisher; `readers` are the subscribers of others."""

    def __init__(self, participant: DomainParticipant, name: str, kind: type[Message], quality: Qos) -> None:
        topic: Any = Topic(participant, topic_name(name), kind)
        self.name = name
        self._writer: Any = DataWriter(participant, topic, qos=quality)
        self.readers = Endpoints(participant, topic_name(name), [quality], writers=False)
        self._known: frozenset[Any] = frozenset()

    def publish(self, message: Message) -> None:
        """Publish a message."""
        self._writer.write(message)

    def received(self, seconds: float) -> bool:
        """Return whether all connected subscribers have received everything within a time; of a reliable publisher."""
        return bool(self._writer.wait_for_acks(duration(seconds=seconds)))

    @property
    def subscribed(self) -> bool:
        """Return whether there was a subscriber at the last call of `joined`."""
        return bool(self._known)

    def joined(self) -> bool:
        """Return whether there is a new subscriber since the last call."""
        known, self._known = self._known, self.readers.connected
        return bool(self._known - known)


class Waiting:
    """Waits until one of several subscriptions has a message, or another thread ends the waiting."""

    def __init__(self, participant: DomainParticipant, topics: Sequence[Subscription[Any]]) -> None:
        self._set: Any = WaitSet(participant)
        self._woken: Any = GuardCondition(participant)
        self._set.attach(self._woken)
        state = SampleState.NotRead | ViewState.Any | Instances.Any
        self._conditions = [ReadCondition(reader, state) for topic in topics for reader in topic.readers]
        for condition in self._conditions:
            self._set.attach(condition)

    def wait(self, seconds: float) -> None:
        """Return when a message has come, after `wake`, or after a time."""
        self._set.wait(duration(seconds=seconds))
        self._woken.take()

    def wake(self) -> None:
        """End the waiting, or the next one; from any thread."""
        self._woken.set(True)


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
                self.subscription.report_undecodable(ros.TFMessage, error)
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
        self.amcl = subscribe("amcl_pose", ros.PoseWithCovarianceStamped, LATCHED, RELIABLE)
        self.initial = publish("initialpose", ros.PoseWithCovarianceStamped, RELIABLE)
        self.pose = publish("linefix/pose", ros.PoseWithCovarianceStamped, RELIABLE)
        self.agreed = publish("linefix/agreed_pose", ros.PoseWithCovarianceStamped, RELIABLE)
        # On a topic of its own: behind robots the map would be no longer latched.
        self.walls = publish("linefix/map_markers", ros.MarkerArray, NEWEST)
        self.markers = publish("linefix/markers", ros.MarkerArray, NEWEST)
        self.map_id = publish("linefix/map_id", ros.String, NEWEST)
        self.status = publish("linefix/status", ros.DiagnosticStatus, NEWEST)
        self.diagnostics = publish("/diagnostics", ros.DiagnosticArray, RELIABLE)
        name = "tf" if options.namespace and not options.frame_prefix else "/tf"
        self.tf = publish(name, ros.TFMessage, RELIABLE) if options.publish_tf else None

    def unprefixed(self, frame: str) -> str:
        """Return the topic on which transforms of a frame come without the prefix of the robot; empty if on none."""
        sought = frame.encode() + b"\0"
        found = (one.subscription.name for one in self.transforms if any(sought in each for each in one.left_out))
        return next(found, "")
