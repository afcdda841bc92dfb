"""The variables of ROS and of Cyclone DDS."""

from __future__ import annotations

import pytest

from cli.entry import run
from ros2 import ConnectionRefusedError, domain_of
from ros2.connecting import configuration_of, connect


def test_the_range_of_discovery() -> None:
    assert configuration_of({}) == ""
    assert configuration_of({"ROS_LOCALHOST_ONLY": "0", "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}) == ""
    local = configuration_of({"ROS_LOCALHOST_ONLY": "1"})
    assert "127.0.0.1" in local
    assert configuration_of({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}) == local
    assert configuration_of({"ROS_LOCALHOST_ONLY": "1", "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}) == local


@pytest.mark.parametrize(
    "environment",
    [{"ROS_LOCALHOST_ONLY": "yes"}, {"ROS_AUTOMATIC_DISCOVERY_RANGE": "local"}, {"ROS_AUTOMATIC_DISCOVERY_RANGE": " "}],
)
def test_a_value_that_ros_does_not_know_is_refused(environment: dict[str, str]) -> None:
    with pytest.raises(ConnectionRefusedError, match="expected"):
        configuration_of(environment)


def test_the_domain() -> None:
    assert domain_of({}) == domain_of({"ROS_DOMAIN_ID": ""}) == 0
    assert domain_of({"ROS_DOMAIN_ID": "232"}) == 232
    for text in ("233", "-1", "a", "1.0", "٣"):
        with pytest.raises(ConnectionRefusedError, match="ROS_DOMAIN_ID"):
            domain_of({"ROS_DOMAIN_ID": text})


def test_a_wrong_configuration_is_the_caller_s_mistake(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", "<CycloneDDS><Domain><Nonsense/></Domain></CycloneDDS>")
    monkeypatch.setenv("ROS_DOMAIN_ID", "141")
    assert run(["ros2"]) == 2
    assert "correct CYCLONEDDS_URI" in capsys.readouterr().err


def test_an_interface_that_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    interface = "<General><Interfaces><NetworkInterface name='nosuch0'/></Interfaces></General>"
    monkeypatch.setenv("CYCLONEDDS_URI", f"<CycloneDDS><Domain>{interface}</Domain></CycloneDDS>")
    with pytest.raises(ConnectionRefusedError, match="nosuch0"):
        connect(142)
