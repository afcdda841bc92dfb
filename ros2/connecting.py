"""The connection to the DDS domain, within the range that the variables of ROS allow."""

from __future__ import annotations

import os
from collections.abc import Mapping, MutableMapping

from cyclonedds.core import DDSException
from cyclonedds.domain import DomainParticipant

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
