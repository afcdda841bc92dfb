"""The log names the missing input, and the diagnostics come without any input."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import pytest
from cyclonedds.domain import DomainParticipant
from cyclonedds.qos import Policy, Qos

import linefix
from ros2 import NodeOptions, messages
from ros2.maps import MapConverter, digest_of
from ros2.topics import LATCHED, RELIABLE, SENSOR, Publisher, Subscription

from .robot import PATIENCE, grid_of_room, running, scan, wait_until

BEST_EFFORT = Qos(Policy.Reliability.BestEffort, Policy.Durability.Volatile, Policy.History.KeepLast(1))


@pytest.fixture
def soon(monkeypatch: pytest.MonkeyPatch) -> None:
    """Look for missing input after 0.1 s."""
    monkeypatch.setattr("ros2.inputs.SILENT_SECONDS", 0.1)


def wait_for(logged: list[str], expected: str, play: Callable[[], None] = lambda: None) -> None:
    def found() -> bool:
        play()
        return any(expected in line for line in logged)

    wait_until(found, lambda: (expected, logged))


def test_missing_scans_are_logged(domain: int, room: linefix.MapIndex, soon: None) -> None:
    logged: list[str] = []
    with running(NodeOptions(domain=domain, namespace="/quiet"), room, logged.append):
        wait_for(logged, f"no publisher on /quiet/scan in domain {domain}; check the topic, ROS_DOMAIN_ID")
        scans = Publisher(DomainParticipant(domain), "/quiet/scan", messages.LaserScan, SENSOR)
        wait_for(logged, "no valid message on /quiet/scan for 0.1 s, although it has a publisher")
        wait_for(logged, "first scan on /quiet/scan", lambda: scans.publish(scan(1)))
        expected = 'no transform from "laser" to "base_link"'
        wait_for(logged, expected, lambda: scans.publish(scan(1)))
        wait_for(logged, "scans arrive, but none can be searched", lambda: scans.publish(scan(1)))


def test_a_missing_map_is_logged(domain: int, soon: None) -> None:
    logged: list[str] = []
    with running(NodeOptions(domain=domain, namespace="/mapless", map_topic="map"), None, logged.append):
        net = DomainParticipant(domain)
        scans = Publisher(net, "/mapless/scan", messages.LaserScan, SENSOR)
        wait_for(logged, f"no publisher on /mapless/map in domain {domain}", lambda: scans.publish(scan(1)))
        maps = Publisher(net, "/mapless/map", messages.OccupancyGrid, BEST_EFFORT)
        expected = f"the publisher of {maps.name} in domain {domain} has an incompatible QoS; publish with reliable QoS"
        wait_for(logged, expected, lambda: scans.publish(scan(1)))


def test_a_map_that_is_not_used_is_not_missing(domain: int, soon: None) -> None:
    logged: list[str] = []
    with running(NodeOptions(domain=domain, namespace="/nameless", map_topic="map"), None, logged.append):
        net = DomainParticipant(domain)
        scans = Publisher(net, "/nameless/scan", messages.LaserScan, SENSOR)
        maps = Publisher(net, "/nameless/map", messages.OccupancyGrid, LATCHED)
        maps.publish(grid_of_room(""))
        wait_for(logged, "the map on /nameless/map is not used", lambda: scans.publish(scan(1)))
        wait_for(logged, "scans arrive, but none can be searched", lambda: scans.publish(scan(1)))
        wait_for(logged, "state no_map: no usable map has been received")
    assert not [line for line in logged if "message on /nameless/map" in line]


def test_a_subscriber_that_receives_nothing_is_logged(domain: int, room: linefix.MapIndex, soon: None) -> None:
    logged: list[str] = []
    with running(NodeOptions(domain=domain, namespace="/late"), room, logged.append):
        net = DomainParticipant(domain)
        _ = Subscription(net, "/late/initialpose", messages.PoseWithCovarianceStamped, LATCHED)
        wait_for(logged, "a subscriber of /late/initialpose requests an incompatible QoS; expected reliable or best")


@pytest.mark.parametrize(("given", "expected"), [("", "beat"), ("amr-7", "amr-7")])
def test_diagnostics_come_once_a_second_without_scans(
    domain: int, room: linefix.MapIndex, given: str, expected: str
) -> None:
    options = NodeOptions(domain=domain, namespace="/beat", hardware_id=given)
    with running(options, room):
        heard = Subscription(DomainParticipant(domain), "/diagnostics", messages.DiagnosticArray, RELIABLE)
        found: list[messages.DiagnosticArray] = []

        def three() -> bool:
            found.extend(heard.take())
            return len(found) >= 3

        wait_until(three)
    times = [one.header.stamp.sec + 1e-9 * one.header.stamp.nanosec for one in found]
    assert min(after - before for before, after in pairwise(times)) > 0.9
    status = found[-1].status[0]
    assert (status.name, status.hardware_id) == ("beat/linefix: localization", expected)
    assert {one.key: one.value for one in status.values}["state"] == "no_scan"


def serialized(second: int, frame: str = "map", cell: int | None = None) -> messages.SerializedGrid:
    grid = grid_of_room(frame)
    grid.header.stamp = grid.info.map_load_time = messages.Time(second, 3)
    if cell is not None:
        grid.data[cell] = 100 - max(0, grid.data[cell])
    found: messages.SerializedGrid = messages.SerializedGrid.deserialize(grid.serialize())
    return found


def test_a_map_that_is_published_again_is_not_converted_again() -> None:
    assert digest_of(serialized(1).serialized) != digest_of(serialized(1, "floor").serialized)
    converter = MapConverter(lambda: None)
    try:
        converter.take(serialized(1))
        wait_until(lambda: converter.result() is not None)
        converter.take(serialized(2))
        assert not converter.busy
        converter.take(serialized(2, cell=70 * 140 + 30))
        assert converter.busy
        wait_until(lambda: converter.result() is not None)
    finally:
        assert converter.end(PATIENCE)
