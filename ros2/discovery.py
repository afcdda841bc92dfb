"""The endpoints of other participants on a topic, and whether their quality of service fits.

Cyclone DDS reports its connections to Python only from version 11 on; its built-in topics list all endpoints in each.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
from cyclonedds.core import InstanceState
from cyclonedds.domain import DomainParticipant
from cyclonedds.qos import Policy, Qos

MOST = 1000  # changes that are taken at a time
DURABILITIES = Policy.Durability.Volatile, Policy.Durability.TransientLocal, Policy.Durability.Transient


class Endpoints:
    """The writers, or the readers, of other participants on a topic.

    Parameters
    ----------
    participant : DomainParticipant
    topic : str
        As DDS names it.
    own : sequence of Qos
        Of this participant's endpoints on the topic.
    writers : bool
        True when the others are writers.
    """

    def __init__(self, participant: DomainParticipant, topic: str, own: Sequence[Qos], *, writers: bool) -> None:
        self._participant, self._topic, self._own, self._writers = participant, topic, own, writers
        self._reader: Any = None
        self._known: dict[Any, bool] = {}

    @property
    def connected(self) -> frozenset[Any]:
        """The ids of those whose quality of service fits."""
        return frozenset(key for key, fitting in self._found().items() if fitting)

    @property
    def incompatible(self) -> bool:
        """Return whether there are some whose quality of service does not fit."""
        return not all(self._found().values())

    def _found(self) -> dict[Any, bool]:
        """Take what has changed; return for each id whether it fits."""
        if self._reader is None:
            built_in = BuiltinTopicDcpsPublication if self._writers else BuiltinTopicDcpsSubscription
            self._reader = BuiltinDataReader(self._participant, built_in)
        while changed := self._reader.take(MOST):
            for one in changed:
                if one.sample_info.instance_state != InstanceState.Alive:
                    self._known.pop(one.key, None)
                elif one.topic_name == self._topic and one.participant_key != self._participant.guid:
                    self._known[one.key] = self._fits(one.qos)
        return self._known

    def _fits(self, other: Qos) -> bool:
        return any(_fits(other, own) if self._writers else _fits(own, other) for own in self._own)


def _fits(offered: Qos, requested: Qos) -> bool:
    """Return whether a writer offers what a reader requests: reliability and durability, in which profiles differ."""
    return _reliable(offered) >= _reliable(requested) and _durability(offered) >= _durability(requested)


def _reliable(qos: Qos) -> bool:
    return isinstance(qos[Policy.Reliability], Policy.Reliability.Reliable)


def _durability(qos: Qos) -> int:
    found = qos[Policy.Durability]
    return DURABILITIES.index(found) if found in DURABILITIES else len(DURABILITIES)
