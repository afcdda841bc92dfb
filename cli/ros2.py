"""``linefix ros2``: scans in and poses out over DDS, for robots with ROS 2."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from .asking import Where
from .errors import RefusedError, WrongUseError, needing
from .inputs import read_maps
from .options import PlainCommand, UsableOptions, flag, grouped, option
from .ros2_parameters import given_parameter, parameters_of, robots_of

if TYPE_CHECKING:
    from ros2 import Maps, NodeOptions

MAX_FRAME = 255  # characters
LEAVING_SECONDS = 1.0  # that the end waits for DDS
NOT_IN_FILES = ("params_file", "ros_args", "remap", "parameter", "log_level", "rosout_logs", "stdout_logs", "help")
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
    stdout_logs: bool = flag("Ignored.", "--enable-stdout-logs/--disable-stdout-logs", hidden=True)
    remap: list[str] | None = option(None, "Remap the name of a topic.", "FROM:=TO", "--remap", "-r")


@grouped
def ros2(robot: RobotOptions, usable: UsableOptions, ros: RosArguments) -> None:
    """Subscribe to scans of ROS 2, and publish initialpose when they agree, until an interrupt.

    The domain is ROS_DOMAIN_ID; ROS_LOCALHOST_ONLY, ROS_AUTOMATIC_DISCOVERY_RANGE and CYCLONEDDS_URI apply as usual.
    """
    with needing("linefix ros2", "formats", "ros2"):
        import ros2 as node_side
    rules = ros.remap or []
    robots = [] if ros.params_file is None else robots_of(ros.params_file)
    if len(robots) > 1 and robot.namespace is None and not any(rule.startswith("__ns:=") for rule in rules):
        raise WrongUseError(
            f"{ros.params_file}: found parameters of {', '.join(robots)}, expected one; add --namespace"
        )
    given = asdict(robot) | asdict(usable)
    names, topics = given.pop("on"), tuple(given.pop("scan") or ("scan",))
    given["map_topic"] = None if names else robot.map_topic
    try:
        remappings = dict(map(node_side.remapping_of, rules))
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

    scans = ", ".join(options.topic(name) for name in options.scans)
    source = f"map from the topic {options.topic(options.map_topic or 'map')}"
    if maps is not None:
        source = f"{'maps' if maps.several else 'map'} {first_of(list(maps.frames))}"
    return (
        f"subscribed to {scans} in domain {options.domain}; {source}; base frame {options.base}; "
        f"{options.topic('initialpose')} when {options.agree} scans agree"
    )


def _maps_at(names: Sequence[str]) -> Maps:
    import linefix
    from ros2 import Maps

    documents = {one.name: Where().whole_map(one.document) for one in read_maps(names)}
    frames = {name: document.get("frame_id") or "map" for name, document in documents.items()}
    for name, frame in frames.items():
        if not (isinstance(frame, str) and frame.isprintable() and len(frame) <= MAX_FRAME):
            raise RefusedError(
                f"{name}: found a frame_id that is not a name, expected at most "
                f"{MAX_FRAME} printable characters; correct it in the map file"
            )
    with needing("a map"):
        several = len(documents) > 1
        index = linefix.index_maps(documents) if several else linefix.index_map(next(iter(documents.values())))
    return Maps(index, frames)
