"""Topics of ROS 2 over DDS: their names, their quality of service, what is read and written."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Generic, TypeVar

from cyclonedds.core import GuardCondition, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.core import InstanceState as Instances
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

Message = TypeVar("Message", bound=IdlStruct)

# What ROS calls sensor data: the newest counts, and what is lost is lost.
SENSOR = Qos(Policy.Reliability.BestEffort, Policy.Durability.Volatile, Policy.History.KeepLast(1))
# Of what each message counts, though some may be lost.
STREAM = Qos(Policy.Reliability.BestEffort, Policy.Durability.Volatile, Policy.History.KeepLast(100))
# What is said once and holds: maps and mounts, also for those who come later.
LATCHED = Qos(
    Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.TransientLocal, Policy.History.KeepLast(10)
)
RELIABLE = Qos(
    Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.Volatile, Policy.History.KeepLast(10)
)


def topic_name(name: str) -> str:
    """Return what DDS calls a topic of ROS: ``/scan`` is ``rt/scan``."""
    return f"rt/{name.strip('/')}"


class Heard(Generic[Message]):
    """A topic that is listened to."""

    def __init__(self, participant: DomainParticipant, name: str, kind: type[Message], quality: Qos) -> None:
        topic: Any = Topic(participant, topic_name(name), kind, qos=quality)
        self.name = name
        self.reader: Any = DataReader(participant, topic, qos=quality)

    def take(self) -> Sequence[Message]:
        """Return what came since it was last asked, oldest first; not what says that a writer has gone."""
        return [sample for sample in self.reader.take(100) if isinstance(sample, IdlStruct)]


class Told(Generic[Message]):
    """A topic that is written to."""

    def __init__(self, participant: DomainParticipant, name: str, kind: type[Message], quality: Qos) -> None:
        topic: Any = Topic(participant, topic_name(name), kind, qos=quality)
        self._writer: Any = DataWriter(participant, topic, qos=quality)

    def say(self, message: Message) -> None:
        """Send a message to whoever listens."""
        self._writer.write(message)


class Waiting:
    """Waits until one of several topics has something, or somebody ends the waiting."""

    def __init__(self, participant: DomainParticipant, topics: Sequence[Heard[Any]]) -> None:
        self._set: Any = WaitSet(participant)
        self._ending: Any = GuardCondition(participant)
        self._set.attach(self._ending)
        state = SampleState.NotRead | ViewState.Any | Instances.Any
        self._conditions = [ReadCondition(topic.reader, state) for topic in topics]
        for condition in self._conditions:
            self._set.attach(condition)

    def wait(self, seconds: float) -> None:
        """Return when something has come, or after a time."""
        self._set.wait(duration(seconds=seconds))

    def end(self) -> None:
        """End the waiting; from any thread."""
        self._ending.set(True)
