"""The example that loads the map of a floor into map_server, with a stand-in for rclpy, which pip cannot install."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from tests.association.scenes import known

FILE = Path(__file__).parents[2] / "examples" / "nav2" / "map_switcher.py"
SUCCESS, NO_FILE = 0, 1


class Timer:
    running = True

    def cancel(self) -> None:
        self.running = False

    def reset(self) -> None:
        self.running = True


class Client:
    """The client of LoadMap: keeps requests, and passes answers on."""

    srv_name = "/map_server/load_map"

    def __init__(self) -> None:
        self.ready, self.requests = True, list[str]()
        self.done: Callable[[Any], None] = lambda _: None

    def service_is_ready(self) -> bool:
        return self.ready

    def call_async(self, request: Any) -> Any:
        self.requests.append(request.map_url)
        return SimpleNamespace(add_done_callback=lambda done: setattr(self, "done", done))

    def answer(self, result: int) -> None:
        self.done(SimpleNamespace(result=lambda: SimpleNamespace(result=result)))


class Node:
    """The part of a node of rclpy that the example uses."""

    def __init__(self, name: str) -> None:
        self.name, self.topics, self.logged, self.published = name, dict[str, Any](), list[str](), list[Any]()
        self.made = Client()

    def declare_parameter(self, name: str, default: str) -> Any:
        return SimpleNamespace(value="/maps" if name == "folder" else default)

    def create_client(self, kind: Any, name: str) -> Client:
        assert name == "map_server/load_map"
        return self.made

    def create_publisher(self, kind: Any, name: str, depth: int) -> Any:
        assert name == "initialpose"
        return SimpleNamespace(publish=self.published.append)

    def create_subscription(self, kind: Any, name: str, take: Callable[[Any], None], quality: Any) -> None:
        self.topics[name] = take

    def create_timer(self, seconds: float, call: Callable[[], None]) -> Timer:
        return Timer()

    def get_logger(self) -> Any:
        return SimpleNamespace(info=self.logged.append, warning=self.logged.append, error=self.logged.append)


@pytest.fixture
def switcher(monkeypatch: pytest.MonkeyPatch) -> Any:
    load_map = SimpleNamespace(Request=SimpleNamespace, Response=SimpleNamespace(RESULT_SUCCESS=SUCCESS))
    names: dict[str, dict[str, Any]] = {
        "rclpy": {}, "geometry_msgs": {}, "geometry_msgs.msg": {"PoseWithCovarianceStamped": object},
        "nav2_msgs": {}, "nav2_msgs.srv": {"LoadMap": load_map}, "rclpy.node": {"Node": Node},
        "rclpy.qos": {"DurabilityPolicy": SimpleNamespace(TRANSIENT_LOCAL=1), "QoSProfile": SimpleNamespace},
        "std_msgs": {}, "std_msgs.msg": {"String": object},
    }  # fmt: skip
    for name, members in names.items():
        module = ModuleType(name)
        vars(module).update(members)
        monkeypatch.setitem(sys.modules, name, module)
    spec = known(importlib.util.spec_from_file_location("map_switcher", FILE))
    module = importlib.util.module_from_spec(spec)
    known(spec.loader).exec_module(module)
    return module.MapSwitcher()


def go_to(switcher: Any, name: str) -> None:
    switcher.topics["linefix/map_id"](SimpleNamespace(data=name))


def test_the_map_is_loaded_and_the_pose_is_published_after_it(switcher: Any) -> None:
    go_to(switcher, "hq-3")
    switcher.topics["initialpose"]("the pose on hq-3")
    assert switcher.made.requests == ["/maps/hq-3.yaml"]
    assert not switcher.settled.running
    switcher.made.answer(SUCCESS)
    assert switcher.settled.running
    switcher.publish()
    assert switcher.published == ["the pose on hq-3"]
    switcher.load()
    assert switcher.made.requests == ["/maps/hq-3.yaml"]


def test_a_map_that_failed_is_requested_again(switcher: Any) -> None:
    switcher.made.ready = False
    go_to(switcher, "hq-3")
    assert "waits for the service /map_server/load_map" in switcher.logged[-1]
    switcher.made.ready = True
    switcher.load()
    switcher.made.answer(NO_FILE)
    assert switcher.logged[-1] == "/maps/hq-3.yaml is not loaded: result 1 of LoadMap"
    assert not switcher.settled.running
    switcher.load()
    assert switcher.made.requests == ["/maps/hq-3.yaml"] * 2


def test_the_last_of_several_floors_is_loaded(switcher: Any) -> None:
    """The robot is on another floor before the map of the first one is loaded."""
    switcher.topics["initialpose"]("a pose")
    go_to(switcher, "hq-3")
    go_to(switcher, "hq-4")
    assert switcher.made.requests == ["/maps/hq-3.yaml"]
    switcher.made.answer(SUCCESS)
    switcher.publish()
    assert switcher.published == []
    assert switcher.made.requests[-1] == "/maps/hq-4.yaml"
    switcher.made.answer(SUCCESS)
    switcher.publish()
    assert switcher.published == ["a pose"]
