"""``linefix ros2``: scans in and poses out over DDS, for robots with ROS 2."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Container, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import typer

from .asking import Where
from .errors import WrongUseError, needing
from .inputs import read_maps
from .options import PlainCommand, UsableOptions, flag, grouped, option

if TYPE_CHECKING:
    from ros2 import Maps, NodeOptions

NODE = "linefix"  # the name of the node in parameter files
ANY = ("**", "*")  # stand for each node or namespace
LEAVING_SECONDS = 1.0  # that the end waits for DDS
NOT_IN_FILES = ("params_file", "ros_args", "remap", "parameter", "ignored", "logs", "help")
IGNORED = ("--log-level", "--log-config-file", "--enclave", "-e")
LOGS = [f"--enable-{one}-logs/--disable-{one}-logs" for one in ("rosout", "stdout", "external-lib")]
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


class RosCommand(PlainCommand):
    """A command whose defaults are parameters of files and of ``-p``: options of the command line count before them.

    Namespace and name of the node, which remappings may change, choose the parameters of files.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the command line."""
        given, _, _ = self.make_parser(ctx).parse_args(args=list(args))
        known, remap = {one.name for one in self.params} - {*NOT_IN_FILES}, given.get("remap") or []
        special = dict(rule.partition(":=")[::2] for rule in own_rules(remap, remap))
        space, node = special.get("__ns", given.get("namespace")), special.get("__node", NODE)
        files = [(one, parameters_of(Path(one), space, known, node)) for one in given.get("params_file") or []]
        rules = [("-p", given_parameter(rule)) for rule in own_rules(given.get("parameter") or [], remap)]
        found = {name: (value, source) for source, some in (*files, *rules) for name, value in some.items()}
        for name, (_, source) in found.items():
            if name not in known:
                expected = ", ".join(sorted("map" if one == "on" else one for one in known))
                raise WrongUseError(f"{source}: found the parameter {name}, expected one of {expected}")
        ctx.default_map = {**(ctx.default_map or {}), **{name: value for name, (value, _) in found.items()}}
        try:
            return super().parse_args(ctx, args)
        except typer.BadParameter as error:
            wrong = getattr(error.param, "name", None)
            if wrong not in found:
                raise
            value, source = found[wrong]
            raise WrongUseError(f"{source}: the parameter {wrong} is {value!r}: {error.message}") from None


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

    params_file: list[Path] | None = option(None, "A parameter file of ROS 2 (YAML); repeatable.", "FILE")
    ros_args: bool = flag("Ignored; the options after it apply as usual.", "--ros-args")
    parameter: list[str] | None = option(None, "Set a parameter, as in ROS 2.", "NAME:=VALUE", "--param", "-p")
    ignored: list[str] | None = option(None, "Ignored, as are the switches of logs.", "TEXT", *IGNORED)
    logs: bool = option(False, "Ignored.", None, *LOGS, hidden=True)
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
        remappings = dict(map(node_side.remapping_of, own_rules(ros.remap or [], ros.remap or [])))
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


def own_rules(rules: Sequence[str], remap: Sequence[str]) -> Iterator[str]:
    """Yield the rules ``[NODE:]name:=value`` for this node without its name, which remappings may change."""
    names = {"", NODE, *ANY, *(rule.partition("__node:=")[2] for rule in remap)}
    for rule in rules:
        node = rule.partition(":=")[0].rpartition(":")[0]
        if node.rpartition("/")[2] in names:
            yield rule[len(node) :].removeprefix(":")


def parameters_of(
    file: Path, namespace: str | None = None, known: Container[str] = (), node: str = NODE
) -> dict[str, Any]:
    """Return the parameters of a file for a robot, by the names of options.

    The sections ``/**`` and ``linefix`` apply to each robot, ``/robot1/linefix`` to that one and with precedence.

    Parameters
    ----------
    file : Path
    namespace : str, optional
        Of the robot, such as ``/robot1``. None: that of the file.
    known : container of str
        Names of options; others in sections of all nodes are left out.
    node : str
        Name of the node.

    Raises
    ------
    WrongUseError
        When there is no such file, it is no file of parameters, it has none for this robot, or, without a namespace,
        those of several robots.
    """
    every = _sections_of(_yaml(file.read_text(encoding="utf-8", errors="replace")))
    sections = {(above, name): some for above, name, some in every if name in (node, *ANY)}
    if not sections:
        raise WrongUseError(f"{file}: found no parameters in YAML, expected {node}: ros__parameters: name: value")
    robots = sorted({above for above, _ in sections if above})
    chosen = "".join(robots[:1]) if namespace is None else namespace.strip("/")
    keys = [(above, name) for above in dict.fromkeys(("", chosen)) for name in (*ANY, node)]
    if sections.keys().isdisjoint(keys) or (namespace is None and len(robots) > 1):
        expected = "expected one; add --namespace" if namespace is None else f"expected those of /{chosen}"
        raise WrongUseError(f"{file}: found parameters of {', '.join(f'/{one}' for one in robots)}, {expected}")
    values: dict[str, Any] = {}
    for key in keys:
        section = _with_lists(sections.get(key, {}), str(file))
        # Parameters of all nodes may be meant for others.
        values.update({name: value for name, value in section.items() if key[1] == node or name in known})
    return values


def given_parameter(rule: str) -> dict[str, Any]:
    """Return a parameter of the command line, ``name:=value``, by the name of its option; raises `WrongUseError`."""
    name, _, text = rule.partition(":=")
    value = _yaml(text)
    if not name or value is None:
        raise WrongUseError(f"-p: found {rule[:80]!r}, expected NAME:=VALUE, such as agree:=5")
    return _with_lists({name: value}, "-p")


def _yaml(text: str) -> Any:
    """Return the value of a text in YAML; None where it is none."""
    from formats.files import load_yaml
    from registration import InputError

    with suppress(InputError):
        return load_yaml(text)
    return None


def _with_lists(section: dict[str, Any], source: str) -> dict[str, Any]:
    """Return a section with `map` and `maps` as the option that takes both, and one scan as a list of one."""
    others = {name: value for name, value in section.items() if value is not None}
    lists = {name: others.pop(name, []) for name in ("map", "maps", "scan")}
    one, several, scans = (value if isinstance(value, list) else [value] for value in lists.values())
    maps = [*one, *several]
    if not all(isinstance(name, str) for name in maps):
        raise WrongUseError(f"{source}: found {str(maps)[:80]}, expected map: NAME, or maps: [NAME, ...]")
    return {**others, **({"on": maps} if maps else {}), **({"scan": scans} if scans else {})}


def _sections_of(document: Any, above: str = "") -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield namespace, name of the node and parameters of each section; namespaces may be nested."""
    for name, inner in document.items() if isinstance(document, dict) else ():
        path = f"{above}/{name}".strip("/")
        space, _, node = path.rpartition("/")
        parameters = inner.get("ros__parameters") if isinstance(inner, dict) else None
        if isinstance(parameters, dict):
            yield "" if space in ANY else space, node, {str(key): value for key, value in parameters.items()}
        else:
            yield from _sections_of(inner, path)
