"""The connection to the DDS domain, within the range that the variables of ROS allow; and who else is there."""

from __future__ import annotations

import os
from collections.abc import Mapping, MutableMapping, Sequence
from typing import Any

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
from cyclonedds.core import DDSException, InstanceState
from cyclonedds.domain import DomainParticipant
from cyclonedds.qos import Policy, Qos

LOCALHOST = (
    "<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast><Interfaces>"
    '<NetworkInterface address="127.0.0.1"/></Interfaces></General><Discovery>'
    "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>99</MaxAutoParticipantIndex>"
    '<Peers><Peer Address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>'
)
ISOLATED = (
    "<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast></General><Discovery>"
    "<ParticipantIndex>none</ParticipantIndex></Discovery></Domain></CycloneDDS>"
)
RANGES = {"": "", "SUBNET": "", "SYSTEM_DEFAULT": "", "NOT_SET": "", "LOCALHOST": LOCALHOST, "OFF": ISOLATED}
MOST_DOMAIN = 232


class ConnectionRefusedError(ValueError):
    """The variables of the environment do not describe a connection; the message names it and the remedy."""


def domain_of(environment: Mapping[str, str]) -> int:
    """Return the domain, ``ROS_DOMAIN_ID``.

    Raises
    ------
    ConnectionRefusedError
        When it is none.
    """
    found = environment.get("ROS_DOMAIN_ID") or "0"
    if not (found.isascii() and found.isdigit() and int(found) <= MOST_DOMAIN):
        raise ConnectionRefusedError(f"ROS_DOMAIN_ID: found {found[:40]!r}, expected a number from 0 to {MOST_DOMAIN}")
    return int(found)


def configuration_of(environment: Mapping[str, str]) -> str:
    """Return the configuration of Cyclone DDS for the variables of ROS; ``CYCLONEDDS_URI`` comes after it.

    ``ROS_LOCALHOST_ONLY=1`` counts before ``ROS_AUTOMATIC_DISCOVERY_RANGE``, as in ROS.

    Raises
    ------
    ConnectionRefusedError
        When a variable has a value that ROS does not define.
    """
    local, discovery = environment.get("ROS_LOCALHOST_ONLY", ""), environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "")
    if local not in ("", "0", "1"):
        raise ConnectionRefusedError(f"ROS_LOCALHOST_ONLY: found {local[:40]!r}, expected 0 or 1")
    if discovery not in RANGES:
        known = ", ".join(one for one in RANGES if one)
        raise ConnectionRefusedError(
            f"ROS_AUTOMATIC_DISCOVERY_RANGE: found {discovery[:40]!r}, expected one of {known}"
        )
    return LOCALHOST if local == "1" else RANGES[discovery]


def connect(domain: int, environment: MutableMapping[str, str] | None = None) -> DomainParticipant:
    """Join a domain.

    Parameters
    ----------
    domain : int
    environment : mutable mapping, optional
        Default: that of the process; ``CYCLONEDDS_URI`` is completed in it.

    Raises
    ------
    ConnectionRefusedError
        When the variables do not describe a connection.
    """
    variables = os.environ if environment is None else environment
    given = variables.get("CYCLONEDDS_URI", "")
    ours = configuration_of(variables)
    if ours:
        variables["CYCLONEDDS_URI"] = f"{ours},{given}" if given else ours
    try:
        return DomainParticipant(domain)
    except DDSException as error:
        raise ConnectionRefusedError(
            f"DDS does not start in domain {domain}: {error.msg or error}; correct CYCLONEDDS_URI "
            f"(found {given[:200]!r}) and see what Cyclone DDS has written above"
        ) from None


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
        self._known: dict[Any, Qos] = {}

    @property
    def connected(self) -> frozenset[Any]:
        """The ids of those whose quality of service fits."""
        return frozenset(key for key, qos in self._found().items() if self._fits(qos))

    @property
    def incompatible(self) -> bool:
        """Return whether there are some whose quality of service does not fit."""
        return not all(map(self._fits, self._found().values()))

    @property
    def best_effort(self) -> bool:
        """Return whether one of them is best effort."""
        return not all(map(_reliable, self._found().values()))

    def _found(self) -> dict[Any, Qos]:
        """Take what has changed; return the quality of service of each id."""
        if self._reader is None:
            built_in = BuiltinTopicDcpsPublication if self._writers else BuiltinTopicDcpsSubscription
            self._reader = BuiltinDataReader(self._participant, built_in)
        while changed := self._reader.take(MOST):
            for one in changed:
                if one.sample_info.instance_state != InstanceState.Alive:
                    self._known.pop(one.key, None)
                elif one.topic_name == self._topic and one.participant_key != self._participant.guid:
                    self._known[one.key] = one.qos
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
