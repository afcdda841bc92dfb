"""Names of topics and frames, and the parameters of files."""

from __future__ import annotations

import sys
from dataclasses import fields
from pathlib import Path

import pytest

from cli.entry import run
from cli.errors import WrongUseError
from cli.options import UsableOptions
from cli.ros2 import RobotOptions
from cli.ros2_parameters import parameters_of
from ros2 import NodeOptions, OptionError, checked_namespace, namespace_of, remapping_of
from ros2.options import absolute_name


def test_the_command_has_the_defaults_of_the_node() -> None:
    found = {one.name: getattr(group, one.name) for group in (RobotOptions(), UsableOptions()) for one in fields(group)}
    assert found.pop("on") is found.pop("scan") is found.pop("namespace") is None
    assert found == {name: getattr(NodeOptions(), name) for name in found} | {"map_topic": "map"}


@pytest.mark.parametrize(
    ("name", "expected"),
    [("scan", "/r1/scan"), ("/scan", "/scan"), ("front/scan", "/r1/front/scan"), ("~/pose", "/r1/linefix/pose")],
)
def test_a_relative_name_is_in_the_namespace(name: str, expected: str) -> None:
    assert absolute_name(name, "/r1") == expected


@pytest.mark.parametrize("name", ["", "/", "a//b", "scan/", "1scan", "a b", "rt/ü", "a" * 300, "scan\n", "{node}/x"])
def test_what_is_no_name_is_refused(name: str) -> None:
    with pytest.raises(OptionError, match="expected a name"):
        absolute_name(name, "")


def test_remappings_hold_for_relative_and_absolute_names() -> None:
    rules = dict(map(remapping_of, ["scan:=/front", "/tf:=tf", "initialpose:=pose_in"]))
    options = NodeOptions(namespace="/r1", remappings=rules)
    assert options.topic("scan") == "/front"
    assert options.topic("/r1/scan") == "/front"
    assert options.topic("/tf") == "/r1/tf"
    assert options.topic("initialpose") == "/r1/pose_in"
    assert options.topic("odom") == "/r1/odom"
    for rule in ("scan", "scan:=", ":=x", "a=b"):
        with pytest.raises(OptionError, match="FROM:=TO"):
            remapping_of(rule)


def test_a_namespace_is_that_of_an_absolute_topic_of_scans() -> None:
    assert namespace_of(("/r1/scan",)) == "/r1"
    assert namespace_of(("/fleet/r1/scan", "/other/scan")) == "/fleet/r1"
    assert namespace_of(("/scan",)) == namespace_of(("front/scan",)) == ""
    assert checked_namespace("r1/") == "/r1"
    assert checked_namespace("/") == ""
    with pytest.raises(OptionError):
        checked_namespace("/a b")


def test_frames_have_the_prefix() -> None:
    prefixed = NodeOptions(frame_prefix="r1/")
    assert prefixed.frame("laser") == prefixed.frame("/r1/laser") == "r1/laser"
    assert prefixed.base_of("r1/laser") == "r1/base_link"
    spaced = NodeOptions(namespace="/r1")
    assert spaced.frame("laser") == "laser"
    assert spaced.base_of("laser") == "base_link"
    assert spaced.base_of("r1/laser") == "r1/base_link"


def test_a_file_of_parameters_is_that_of_ros(tmp_path: Path) -> None:
    file = tmp_path / "linefix.yaml"
    file.write_text(
        "/**:\n  ros__parameters:\n    agree: 4\n    base: chassis\n"
        "/robot1/linefix:\n  ros__parameters:\n    agree: 5\n    map: hq.yaml\n    scan: [/a, /b]\n"
        "amcl:\n  ros__parameters:\n    agree: 9\n"
    )
    assert parameters_of(file, None, ("agree", "base")) == {
        "agree": 5,
        "base": "chassis",
        "on": ["hq.yaml"],
        "scan": ["/a", "/b"],
    }
    for text in ("", "[1]", "linefix: 3", "a: b: c", "\x00", "other:\n  ros__parameters: {}", "x: &a 1\ny: {<<: *a}"):
        file.write_text(text)
        with pytest.raises(WrongUseError, match="ros__parameters"):
            parameters_of(file)


def test_maps_are_a_list_and_a_later_section_replaces_them(tmp_path: Path) -> None:
    file = tmp_path / "linefix.yaml"
    file.write_text(
        "/**:\n  ros__parameters: {maps: [hq-1.yaml, hq-2.yaml]}\n"
        "/robot1/linefix:\n  ros__parameters: {map: hall.yaml}\n"
    )
    assert parameters_of(file, "/robot2", ("on",)) == {"on": ["hq-1.yaml", "hq-2.yaml"]}
    assert parameters_of(file, "/robot1", ("on",)) == {"on": ["hall.yaml"]}


FLEET = (
    "linefix:\n  ros__parameters: {agree: 4}\n"
    "/robot1/linefix:\n  ros__parameters: {map: one.yaml}\n"
    "/robot2/linefix:\n  ros__parameters: {map: two.yaml, agree: 5}\n"
)


def test_a_file_may_have_the_parameters_of_several_robots(tmp_path: Path) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text(FLEET)
    assert parameters_of(file, "/robot1") == {"agree": 4, "on": ["one.yaml"]}
    assert parameters_of(file, "robot2/") == {"agree": 5, "on": ["two.yaml"]}
    assert parameters_of(file, "robot3") == parameters_of(file) == {"agree": 4}
    file.write_text("/robot1/linefix:\n  ros__parameters: {agree: 4}\n")
    with pytest.raises(WrongUseError, match=r"of /robot1, expected those of /robot2"):
        parameters_of(file, "robot2")


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--params-file", "FILE", "--namespace", "robot2"], "two.yaml"),
        (["--namespace", "robot1", "--params-file", "FILE"], "one.yaml"),
        (["--ros-args", "-r", "__ns:=/robot2", "--params-file", "FILE"], "two.yaml"),
        (["--ros-args", "--params-file", "FILE", "-r", "__ns:=/robot1"], "one.yaml"),
        (["--params-file", "FILE"], "found parameters of /robot1, /robot2, expected one; add --namespace"),
    ],
)
def test_the_namespace_chooses_the_parameters_of_a_robot(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], expected: str
) -> None:
    """The map of the chosen robot is looked for."""
    file = tmp_path / "fleet.yaml"
    file.write_text(FLEET)
    assert run(["ros2", *(str(file) if one == "FILE" else one for one in arguments)]) == 2
    assert expected in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("agrees: 3", "found the parameter agrees, expected one of"),
        ("agree: many", "agree"),
        ("agree: 0", "agree"),
        ("when: never", "when"),
        ("map: nowhere.yaml", "nowhere.yaml: there is no such file"),
        ("maps: [nowhere.yaml]", "nowhere.yaml: there is no such file"),
        ("map: [hq-1.yaml]", "found [['hq-1.yaml']], expected map: NAME, or maps: [NAME, ...]"),
        ("maps: [7]", "found [7], expected map: NAME, or maps: [NAME, ...]"),
    ],
)
def test_a_wrong_parameter_ends_with_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, expected: str
) -> None:
    file = tmp_path / "linefix.yaml"
    file.write_text(f"linefix:\n  ros__parameters:\n    {text}\n")
    assert run(["ros2", "--params-file", str(file)]) == 2
    assert expected in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["-p", "map:=one.yaml"], "one.yaml: there is no such file"),
        (["--params-file", "FILE", "-p", "linefix:map:=one.yaml"], "one.yaml: there is no such file"),
        (["-p", "use_sim_time:=true", "--log-level", "linefix:=debug", "--disable-rosout-logs"], "two.yaml"),
        (["-p", "agrees:=3"], "-p: found the parameter agrees, expected one of agree, base,"),
        (["-p", "agree=3"], "-p: found 'agree=3', expected NAME:=VALUE"),
        (["-p", "agree:=many"], "agree"),
    ],
)
def test_arguments_of_ros_are_taken(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], expected: str
) -> None:
    """A file that other nodes share has parameters that this one does not."""
    file = tmp_path / "shared.yaml"
    file.write_text(
        "/**:\n  ros__parameters: {use_sim_time: true, robot_radius: 0.3}\n"
        "amcl:\n  ros__parameters: {agrees: 9}\nlinefix:\n  ros__parameters: {map: two.yaml}\n"
    )
    arguments = [str(file) if one == "FILE" else one for one in arguments]
    files = [] if "--params-file" in arguments else ["--params-file", str(file)]
    assert run(["ros2", "--ros-args", *arguments, *files]) == 2
    assert expected in (said := capsys.readouterr().err)
    assert " on," not in said


@pytest.mark.parametrize(
    "arguments", [["--scan", "a b"], ["-r", "scan"], ["--namespace", "1"], ["--map-topic", "//"], ["--odom", ""]]
)
def test_a_wrong_name_ends_with_2(arguments: list[str], capsys: pytest.CaptureFixture[str], domain: int) -> None:
    assert run(["ros2", *arguments]) == 2
    assert "expected" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("hq.json", "{}", "map.segments: expected at least one segment, found none"),
        ("hq.yaml", "hq", "hq.yaml: expected a YAML mapping with image, resolution and origin"),
        ("hq.yaml", "{image: hq.pgm, resolution: 0.05, origin: [0, 0, 0]}", "hq.pgm"),
    ],
)
def test_a_map_that_cannot_be_used_ends_with_3(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, text: str, expected: str
) -> None:
    (tmp_path / name).write_text(text)
    assert run(["ros2", "--map", str(tmp_path / name)]) == 3
    assert expected in capsys.readouterr().err


def test_packages_that_are_missing_end_with_3(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "ros2", None)
    assert run(["ros2"]) == 3
    assert 'pip install ".[formats,ros2]"' in capsys.readouterr().err
