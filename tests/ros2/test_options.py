"""Names of topics and frames, and the parameters of files."""

from __future__ import annotations

import sys
from dataclasses import fields
from pathlib import Path

import pytest

from cli.entry import run
from cli.errors import WrongUseError
from cli.options import UsableOptions
from cli.ros2 import RobotOptions, parameters_of
from ros2 import NodeOptions, OptionError, checked_namespace, namespace_of, remapping_of
from ros2.options import absolute_name


def test_the_command_has_the_defaults_of_the_node() -> None:
    found = {one.name: getattr(group, one.name) for group in (RobotOptions(), UsableOptions()) for one in fields(group)}
    assert found.pop("on") is found.pop("scan") is found.pop("namespace") is None
    assert found == {name: getattr(NodeOptions(), name) for name in found} | {"map_topic": "map"}


def test_remappings_hold_for_relative_and_absolute_names() -> None:
    rules = dict(map(remapping_of, ["scan:=/front", "/tf:=tf", "initialpose:=pose_in"]))
    options = NodeOptions(namespace="/r1", remappings=rules)
    assert options.topic("scan") == "/front"
    assert options.topic("/r1/scan") == "/front"
    assert options.topic("/tf") == "/r1/tf"
    assert options.topic("initialpose") == "/r1/pose_in"
    assert options.topic("odom") == "/r1/odom"
    assert options.topic("front/scan") == "/r1/front/scan"
    assert options.topic("~/pose") == "/r1/linefix/pose"
    for rule in ("scan", "scan:=", ":=x", "a=b"):
        with pytest.raises(OptionError, match="FROM:=TO"):
            remapping_of(rule)


def test_a_namespace_is_that_of_an_absolute_topic_of_scans() -> None:
    assert namespace_of(("/r1/scan",)) == "/r1"
    assert namespace_of(("/fleet/r1/scan", "/other/scan")) == "/fleet/r1"
    assert namespace_of(("/scan",)) == namespace_of(("front/scan",)) == ""
    assert checked_namespace("r1/") == "/r1"
    assert checked_namespace("/") == ""
    for name in ("", "a b", "x\n"):
        with pytest.raises(OptionError, match="expected a name"):
            absolute_name(name, "")


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
    expected = {"agree": 5, "base": "chassis", "on": ["hq.yaml"], "scan": ["/a", "/b"]}
    assert parameters_of(file, None, ("agree", "base")) == expected
    for text in ("", "[1]", "linefix: 3", "a: b: c", "\x00", "other:\n  ros__parameters: {}", "x: &a 1\ny: {<<: *a}"):
        file.write_text(text)
        with pytest.raises(WrongUseError, match="ros__parameters"):
            parameters_of(file)


FLEET = (
    "linefix:\n  ros__parameters: {agree: 4, maps: [hq-1.yaml, hq-2.yaml]}\n"
    "/robot1/linefix:\n  ros__parameters: {map: one.yaml}\n"
    "/robot2/linefix:\n  ros__parameters: {map: two.yaml, agree: 5}\n"
)


def test_a_file_may_have_the_parameters_of_several_robots(tmp_path: Path) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text(FLEET)
    assert parameters_of(file, "/robot1") == {"agree": 4, "on": ["one.yaml"]}
    assert parameters_of(file, "robot2/") == {"agree": 5, "on": ["two.yaml"]}
    assert parameters_of(file, "robot3") == {"agree": 4, "on": ["hq-1.yaml", "hq-2.yaml"]}
    file.write_text("/robot1/linefix:\n  ros__parameters: {agree: 4}\n")
    with pytest.raises(WrongUseError, match=r"of /robot1, expected those of /robot2"):
        parameters_of(file, "robot2")


def of_node(parameters: str) -> str:
    return f"linefix:\n  ros__parameters: {{{parameters}}}\n"


# A file that other nodes share has parameters that this one does not.
SHARED = (
    "/**:\n  ros__parameters: {use_sim_time: true, robot_radius: 0.3}\n"
    "amcl:\n  ros__parameters: {agrees: 9}\nlinefix:\n  ros__parameters: {map: two.yaml}\n"
)
NOBODY = "{}.yaml: there is no such file"
# The text of FILE, arguments, and what the error says; where all is right, a map is looked for that is not there.
ENDED_WITH_2: list[tuple[str, str, str]] = [
    (FLEET, "--params-file FILE --namespace robot2", "two.yaml"),
    (FLEET, "--namespace robot1 --params-file FILE", "one.yaml"),
    (FLEET, "--ros-args -r __ns:=/robot2 --params-file FILE", "two.yaml"),
    (FLEET, "--ros-args --params-file FILE -r __ns:=/robot1", "one.yaml"),
    (FLEET, "--params-file FILE", "found parameters of /robot1, /robot2, expected one; add --namespace"),
    (of_node("agrees: 3"), "--params-file FILE", "found the parameter agrees, expected one of"),
    (of_node("agree: many"), "--params-file FILE", "parameters.yaml: the parameter agree is 'many': "),
    (of_node("agree: 0"), "--params-file FILE", "parameters.yaml: the parameter agree is 0: "),
    (of_node("when: never"), "--params-file FILE", "when"),
    (of_node("map: nowhere.yaml"), "--params-file FILE", NOBODY.format("nowhere")),
    (of_node("maps: [nowhere.yaml]"), "--params-file FILE", NOBODY.format("nowhere")),
    (of_node("map: [nowhere.yaml]"), "--params-file FILE", NOBODY.format("nowhere")),
    ("r1: {linefix: {ros__parameters: {map: nowhere.yaml}}}", "--params-file FILE -r __ns:=/r1", "nowhere.yaml"),
    (f"/**/{of_node('map: nowhere.yaml')}", "--params-file FILE -r __ns:=/robot1", "nowhere.yaml"),
    (SHARED, "--params-file FILE -r __node:=amcl", "found the parameter agrees, expected one of"),
    (SHARED, "--params-file FILE -r __node:=other -p other:map:=one.yaml", "one.yaml"),
    (SHARED, "--params-file FILE --params-file FILE.yaml", "parameters.yaml.yaml"),
    (of_node("maps: [7]"), "--params-file FILE", "found [7], expected map: NAME, or maps: [NAME, ...]"),
    (SHARED, "--ros-args -p map:=one.yaml --params-file FILE", NOBODY.format("one")),
    (SHARED, "--ros-args --params-file FILE -p linefix:map:=one.yaml", NOBODY.format("one")),
    (SHARED, "--ros-args -p use_sim_time:=true --log-level linefix:=debug --params-file FILE -e x "
             "--disable-rosout-logs --disable-stdout-logs --log-config-file x", "two.yaml"),
    (SHARED, "--ros-args --params-file FILE -p scan:=front -r amcl:scan -p amcl:agree:=0", "two.yaml"),
    (SHARED, "--ros-args -p agrees:=3 --params-file FILE", "-p: found the parameter agrees, expected one of agree, "),
    (SHARED, "--ros-args -p agree=3 --params-file FILE", "-p: found 'agree=3', expected NAME:=VALUE"),
    (SHARED, "--ros-args -p agree:=many --params-file FILE", "-p: the parameter agree is 'many': "),
    *(("", arguments, "expected")
      for arguments in ("-r scan", "--namespace 1", "--map-topic //", "--odom rt/\u00fc", "--scan {node}/x")),
    *(("", f"--scan {name}", "expected a name") for name in ("/", "a//b", "scan/", "1scan", "a" * 300)),
]  # fmt: skip


@pytest.mark.usefixtures("domain")
@pytest.mark.parametrize(("text", "arguments", "expected"), ENDED_WITH_2, ids=range(len(ENDED_WITH_2)))
def test_a_wrong_option_or_parameter_ends_with_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, arguments: str, expected: str
) -> None:
    file = tmp_path / "parameters.yaml"
    file.write_text(text)
    assert run(["ros2", *arguments.replace("FILE", str(file)).split()]) == 2
    assert expected in (said := capsys.readouterr().err)
    assert " on," not in said


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
