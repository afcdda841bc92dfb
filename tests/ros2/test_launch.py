"""The launch file, with a stand-in for the packages of ROS 2, which pip cannot install."""

from __future__ import annotations

import runpy
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
import typer.main

from cli.program import app

FILE = Path(__file__).parents[2] / "examples" / "nav2" / "linefix.launch.py"
RUNNING = SimpleNamespace(is_shutdown=False)


def recorded(name: str) -> Callable[..., Any]:
    """Return the stand-in of a class: it keeps its arguments."""
    return lambda *words, **named: SimpleNamespace(kind=name, words=words, **named)


@dataclass
class LaunchConfiguration:
    """An argument of the launch file; without a value it has its default."""

    name: str
    values: dict[str, str] = field(default_factory=dict)

    def perform(self, context: Any) -> str:
        return self.values.get(self.name, "")


class Launch:
    """The launch file with values for its arguments."""

    def __init__(self, values: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
        actions = "DeclareLaunchArgument", "EmitEvent", "ExecuteProcess", "OpaqueFunction", "RegisterEventHandler"
        names: dict[str, dict[str, Any]] = {
            "launch": {"LaunchDescription": list},
            "launch.actions": {name: recorded(name) for name in (*actions, "TimerAction")},
            "launch.event_handlers": {"OnProcessExit": recorded("OnProcessExit")},
            "launch.events": {"Shutdown": recorded("Shutdown")},
            "launch.substitutions": {"LaunchConfiguration": lambda name: LaunchConfiguration(name, values)},
        }
        for name, members in names.items():
            module = ModuleType(name)
            vars(module).update(members)
            monkeypatch.setitem(sys.modules, name, module)
        self._functions = runpy.run_path(str(FILE))

    def words(self) -> list[str]:
        """Return the command that is started."""
        *_, function = self._functions["generate_launch_description"]()
        process, handler = function.function(RUNNING)
        assert process.respawn is False  # but for what `ended` starts
        assert handler.words[0].target_action is process
        words: list[str] = process.cmd
        return words

    def ended(self, code: int) -> list[Any]:
        """Return what follows the end of the process."""
        found: list[Any] = self._functions["ended"](SimpleNamespace(returncode=code), RUNNING)
        return found


VALUES = {
    "map": "/maps/hq-1.yaml,/maps/hq-2.yaml", "map_topic": "/map", "scan": "front,back", "odom": "wheels",
    "base": "base_footprint", "odom_frame": "odometry", "namespace": "robot1", "frame_prefix": "robot1/",
    "together_s": "0.2", "on_map": "1.0", "usable_from": "0.9",
    "agree": "4", "when": "lost", "min_sigma": "0.1", "min_sigma_theta": "0.1",
    "hardware_id": "amr-17", "motion": "false", "publish_tf": "true",
}  # fmt: skip


def test_the_command_has_the_arguments(monkeypatch: pytest.MonkeyPatch) -> None:
    words = Launch(VALUES, monkeypatch).words()
    assert words[:2] == ["linefix", "ros2"]
    command = typer.main.get_command(app).commands["ros2"]  # type: ignore[attr-defined]
    found = command.make_context("ros2", words[2:], resilient_parsing=True).params
    lists = {name: VALUES[name].split(",") for name in ("map", "scan")}
    texts = {name: VALUES[name] for name in VALUES if name not in ("motion", "publish_tf")}
    expected: dict[str, Any] = {**texts, **lists, "motion": False, "publish_tf": True}
    assert {("map" if name == "on" else name): plain(value) for name, value in found.items() if value} == {
        name: value for name, value in expected.items() if value
    }


def plain(value: Any) -> Any:
    """Return a value as the launch file has it."""
    return value if isinstance(value, bool) else list(value) if isinstance(value, (list, tuple)) else str(value)


def test_without_arguments_the_command_has_no_options(monkeypatch: pytest.MonkeyPatch) -> None:
    assert Launch({}, monkeypatch).words() == ["linefix", "ros2"]


def test_only_a_crash_is_followed_by_a_restart(monkeypatch: pytest.MonkeyPatch) -> None:
    launch = Launch({}, monkeypatch)
    assert launch.ended(0) == []
    for code in (2, 3):
        (stop,) = launch.ended(code)
        assert (stop.kind, stop.event.kind) == ("EmitEvent", "Shutdown")
    (again,) = launch.ended(-11)
    assert again.kind == "TimerAction"
    assert again.period > 0.0
