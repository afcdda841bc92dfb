"""``linefix ros2``: scans in and poses out over DDS, for robots with ROS 2."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Container, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from .asking import Where
from .errors import WrongUseError, needing
from .inputs import read_maps
from .options import PlainCommand, UsableOptions, flag, grouped, option

if TYPE_CHECKING:
    from ros2 import Maps, NodeOptions

NODE = "linefix"  # the name of the node in parameter files
ANY = "**"  # stands for each node
LEAVING_SECONDS = 1.0  # that the end waits for DDS
NOT_IN_FILES = ("params_file", "ros_args", "remap", "parameter", "log_level", "rosout_logs", "help")
LEAST = "Minimum standard deviation"
TOGETHER = "Search scans of several topics as one if they are so close in time; 0: never."
STOP_TF = "Stop the transform of --publish-tf this long after the last scan with ranges; 0: never."
PUBLISH_TF = "Publish the transform from the map to the odometry frame. Do not use it together with AMCL."
WHEN = (
    "When to publish initialpose. start: at the start, on request and for new subscribers; lost: also when the "
    "localizer disagrees; always: also for each scan that confirms the pose."
)
MAPS = (
    "A map file, a folder of map files, or the id of a stored map; repeat for more maps, which are searched together. "
    "Default: the topic of --map-topic."
)

Sections = dict[tuple[str, str], dict[str, Any]]


class RosCommand(PlainCommand):
    """A command whose defaults are parameters of a file and of ``-p``: options of the command line count before them.

    The namespace, from itself or from remappings, chooses the parameters of the file.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the command line."""
        given, _, _ = self.make_parser(ctx).parse_args(args=list(args))
        file, known = given.get("params_file"), {one.name for one in self.params} - {*NOT_IN_FILES}
        spaces = [rule[6:] for rule in given.get("remap") or [] if rule.startswith("__ns:=")]
        space = spaces[-1] if spaces else given.get("namespace")
        values = {} if file is None else parameters_of(Path(file), space, known)
        ruled = {name: one for rule in given.get("parameter") or [] for name, one in given_parameter(rule).items()}
        for name in {**values, **ruled}:
            if name not in known:
                expected = ", ".join(sorted("map" if one == "on" else one for one in known))
                source = "-p" if name in ruled else file
                raise WrongUseError(f"{source}: found the parameter {name}, expected one of {expected}")
        ctx.default_map = {**(ctx.default_map or {}), **values, **ruled}
        return super().parse_args(ctx, args)


@dataclass(frozen=True, slots=True)
class RobotOptions:
    """The maps, topics and frames of the robot, and when its pose is published, as options."""

    on: list[str] | None = option(None, MAPS, "MAP", "--map")
    map_topic: str = option("map", "Topic of an OccupancyGrid, without --map.", "TOPIC")
    scan: list[str] | None = option(None, "Topic of scans; repeat for more scanners. Default: scan.", "TOPIC")
    together_s: float = option(0.1, TOGETHER, "SECONDS", min=0.0, max=5.0)
    odom: str = option("odom", "Topic of odometry.", "TOPIC")
    motion: bool = option(True, "Correct the motion during a scan by the twist of odometry.")
    base: str = option("base_link", "The base frame of the robot.", "FRAME")
    odom_frame: str = option("odom", "The odometry frame, if no odometry message names it.", "FRAME")
    namespace: str | None = option(
        None, "Namespace of all relative topics. Default: that of the first --scan.", "NAMESPACE"
    )
    frame_prefix: str = option("", "Prefix of all frames of the robot, such as robot1/.", "PREFIX")
    agree: int = option(3, "Number of scans that have to agree on a published pose.", "N", min=1, max=100)
    when: Literal["start", "lost", "always"] = option("start", WHEN)
    min_sigma: float = option(0.05, f"{LEAST} of the position in initialpose.", "METRES", min=0.0, max=10.0)
    min_sigma_theta: float = option(0.0349, f"{LEAST} of the heading in initialpose.", "RADIANS", min=0.0, max=3.0)
    publish_tf: bool = option(False, PUBLISH_TF)
    tf_max_age_s: float = option(0.0, STOP_TF, "SECONDS", min=0.0, max=3600.0)
    surface: float | None = option(None, "Depth of walls' surfaces in the map's cells.", "CELLS", min=0.0, max=10.0)
    use_sim_time: bool = option(False, "Use the time of /clock.")
    hardware_id: str = option("", "Hardware id of the diagnostics. Default: the namespace.", "NAME")


@dataclass(frozen=True, slots=True)
class RosArguments:
    """Parameters and remappings in the way of ROS 2, as options."""

    params_file: Path | None = option(None, "A parameter file of ROS 2 (YAML).", "FILE")
    ros_args: bool = flag("Ignored; the options after it apply as usual.", "--ros-args")
    parameter: list[str] | None = option(None, "Set a parameter, as in ROS 2.", "NAME:=VALUE", "--param", "-p")
    log_level: list[str] | None = option(None, "Ignored, as are rosout logs.", "LEVEL")
    rosout_logs: bool = flag("Ignored.", "--enable-rosout-logs/--disable-rosout-logs", hidden=True)
    remap: list[str] | None = option(None, "Remap the name of a topic.", "FROM:=TO", "--remap", "-r")


@grouped
def ros2(robot: RobotOptions, usable: UsableOptions, ros: RosArguments) -> None:
    """Subscribe to scans of ROS 2, and publish initialpose when they agree, until an interrupt.

    The domain is ROS_DOMAIN_ID; ROS_LOCALHOST_ONLY, ROS_AUTOMATIC_DISCOVERY_RANGE and CYCLONEDDS_URI apply as usual.
    """
    with needing("linefix ros2", "formats", "ros2"):
        import ros2 as node_side
    given = asdict(robot) | asdict(usable)
    names, topics = given.pop("on"), tuple(given.pop("scan") or ("scan",))
    given["map_topic"] = None if names else robot.map_topic
    try:
        remappings = dict(map(node_side.remapping_of, ros.remap or []))
        remappings.pop("__node", None)
        space = remappings.pop("__ns", robot.namespace)
        space = node_side.checked_namespace(node_side.namespace_of(topics) if space is None else space)
        given |= {"namespace": space, "remappings": remappings, "domain": node_side.domain_of(os.environ)}
        options = node_side.NodeOptions(scans=topics, **given)
        maps = _maps_at(names) if names else None
        node = node_side.Node(options, maps)
    except (node_side.OptionError, node_side.ConnectionRefusedError) as error:
        raise WrongUseError(str(error)) from None
    _run(node, options, maps)


def _run(node: Any, options: NodeOptions, maps: Maps | None) -> None:
    from linefix.warmup import warm_up

    warm_up()  # or the first scans would wait for it
    node.wait_until_ready()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: node.end())
    print(f"linefix: {_started(options, maps)}", file=sys.stderr, flush=True)
    node.run()
    node.close()
    # DDS waits without limit for a robot that is gone, and Python for a search that does not end.
    leaving = threading.Thread(target=node.leave, daemon=True)
    leaving.start()
    leaving.join(LEAVING_SECONDS)
    sys.stderr.flush()
    os._exit(0)


def _started(options: NodeOptions, maps: Maps | None) -> str:
    from formats.report import first_of

    scans = ", ".join(map(options.topic, options.scans))
    on = f"topic {options.topic(options.map_topic or 'map')}" if maps is None else first_of(list(maps.frames))
    return (
        f"subscribed to {scans} in domain {options.domain}; map: {on}; base frame {options.base}; "
        f"{options.topic('initialpose')} when {options.agree} scans agree"
    )


def _maps_at(names: Sequence[str]) -> Maps:
    import linefix
    from ros2 import Maps

    documents = {one.name: Where().whole_map(one.document) for one in read_maps(names)}
    with needing("a map"):
        several = len(documents) > 1
        index = linefix.index_maps(documents) if several else linefix.index_map(next(iter(documents.values())))
    return Maps(index, {name: document.get("frame_id", "map") for name, document in documents.items()})


def parameters_of(file: Path, namespace: str | None = None, known: Container[str] = ()) -> dict[str, Any]:
    """Return the parameters of a file for a robot, by the names of options.

    The sections ``/**`` and ``linefix`` apply to each robot, ``/robot1/linefix`` to that one and with precedence.

    Parameters
    ----------
    file : Path
    namespace : str, optional
        Of the robot, such as ``/robot1``. None: that of the file.
    known : container of str
        Names of options; others in sections of all nodes are left out.

    Raises
    ------
    WrongUseError
        When there is no such file, it is no file of parameters, it has none for this robot, or, without a namespace,
        those of several robots.
    """
    sections = _sections_of(file)
    robots = sorted({above for above, _ in sections if above})
    chosen = "".join(robots[:1]) if namespace is None else namespace.strip("/")
    keys = [(above, node) for above in dict.fromkeys(("", chosen)) for node in (ANY, NODE)]
    if sections.keys().isdisjoint(keys) or (namespace is None and len(robots) > 1):
        expected = "expected one; add --namespace" if namespace is None else f"expected those of /{chosen}"
        raise WrongUseError(f"{file}: found parameters of {', '.join(f'/{one}' for one in robots)}, {expected}")
    values: dict[str, Any] = {}
    for above, node in keys:
        section = _with_maps(sections.get((above, node), {}), file)
        # Parameters of all nodes may be meant for others.
        values.update({name: value for name, value in section.items() if node == NODE or name in known})
    return values


def given_parameter(rule: str) -> dict[str, Any]:
    """Return a parameter of the command line, ``name:=value``, by the name of its option; raises `WrongUseError`."""
    name, _, text = rule.partition(":=")
    node, _, name = name.rpartition(":")
    value = _yaml(text)
    if not name or value is None or node.strip("/").rpartition("/")[2] not in ("", NODE):
        raise WrongUseError(f"-p: found {rule[:80]!r}, expected NAME:=VALUE, such as agree:=5")
    return _with_maps({name: value}, Path("-p"))


def _yaml(text: str) -> Any:
    """Return the value of a text in YAML; None where it is none."""
    from formats.files import load_yaml
    from registration import InputError

    try:
        return load_yaml(text)
    except InputError:
        return None


def _with_maps(section: dict[str, Any], file: Path) -> dict[str, Any]:
    """Return a section with `map`, a text, or `maps`, a list, as the option that takes both; raises `WrongUseError`."""
    others = {name: value for name, value in section.items() if value is not None}
    one, several = others.pop("map", None), others.pop("maps", None) or []
    maps = [*([] if one is None else [one]), *(several if isinstance(several, list) else [several])]
    if not all(isinstance(name, str) for name in maps):
        raise WrongUseError(
            f"{file}: found {str(maps)[:80]}, expected map: NAME, or maps: [NAME, ...] with names of maps"
        )
    return {**others, "on": maps} if maps else others


def _sections_of(file: Path) -> Sections:
    """Return the sections of the node by namespace and name of the node."""
    document = _yaml(file.read_text(encoding="utf-8", errors="replace"))
    sections: Sections = {}
    for name, inner in document.items() if isinstance(document, dict) else ():
        above, _, node = str(name).strip("/").rpartition("/")
        parameters = inner.get("ros__parameters") if isinstance(inner, dict) else None
        if node in (NODE, ANY) and isinstance(parameters, dict):
            sections[above, node] = {str(key): value for key, value in parameters.items()}
    if not sections:
        raise WrongUseError(f"{file}: found no parameters in YAML, expected {NODE}: ros__parameters: name: value")
    return sections
