"""The files for Nav2 and systemd name what ``linefix ros2`` has."""

from __future__ import annotations

import ast
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import pytest
import typer.main
from ruamel.yaml import YAML

from cli.program import app
from cli.ros2 import NOT_IN_FILES, parameters_of

ROOT = Path(__file__).parents[2]
NAV2 = ROOT / "examples" / "nav2"


@pytest.fixture(scope="module")
def options() -> dict[str, Any]:
    command = typer.main.get_command(app).commands["ros2"]  # type: ignore[attr-defined]
    names = {"on": "maps"}
    found = {names.get(one.name, one.name): one for one in command.params if one.name not in NOT_IN_FILES}
    return found


def test_the_file_of_parameters_has_every_option_with_its_default(options: dict[str, Any]) -> None:
    values = parameters_of(NAV2 / "linefix.yaml")
    assert set(values) == set(options) - {"maps", "namespace", "surface"}
    for name, value in values.items():
        default = options[name].default
        assert value == (["scan"] if name == "scan" else default), name


def test_the_launch_file_has_every_option(options: dict[str, Any]) -> None:
    tree = ast.parse((NAV2 / "linefix.launch.py").read_text())
    tables = {
        node.targets[0].id: ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name) and isinstance(node.value, ast.Dict)
    }
    assert set(tables["OPTIONS"]) | set(tables["FLAGS"]) == set(options) - {"maps"} | {"map", "params_file"}
    assert set(tables["FLAGS"]) == {name for name, one in options.items() if one.is_flag}


def test_the_other_files_can_be_read() -> None:
    for name in ("nav2_params.yaml", "linefix.rviz"):
        assert isinstance(YAML(typ="safe").load((NAV2 / name).read_text()), dict)
    assert ElementTree.parse(NAV2 / "recovery.xml").getroot().tag == "root"


def test_the_unit_does_not_start_again_after_a_wrong_option() -> None:
    unit = (ROOT / "deploy" / "linefix-ros2.service").read_text()
    assert "RestartPreventExitStatus=2 3" in unit
    assert "linefix ros2 --params-file" in unit
