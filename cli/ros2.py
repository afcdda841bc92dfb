"""``linefix ros2``: scans in and poses out over DDS, for robots with ROS 2."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from .errors import RefusedError, WrongUseError
from .inputs import needing_formats
from .options import UsableOptions, grouped
from .printing import Json
from .ros2_parameters import given_parameter, parameters_of, robots_of
from .several import read_maps

if TYPE_CHECKING:
    from ros2 import Maps, NodeOptions

MAX_FRAME = 255  # characters
LEAVING_SECONDS = 1.0  # that the end waits for DDS
# Of the context: what the command line has.
CHOSEN, FILE, GIVEN = "linefix.ros2.namespace", "linefix.ros2.file", "linefix.ros2.parameters"
NOT_IN_FILES = ("params_file", "ros_args", "remap", "parameter", "log_level", "rosout_logs", "stdout_logs", "help")
OF_ALL_NODES = ("use_sim_time",)  # which changes nothing here: times are those of messages


def _read_params(context: typer.Context, file: Path | None) -> Path | None:
    """Take the parameters of a file as defaults: what stands on the command line counts before them."""
    context.meta[FILE] = file, context.default_map or {}
    _take_defaults(context)
    return file


def _read_namespace(context: typer.Context, value: Any) -> Any:
    """Take the namespace, from itself or from remappings: it chooses the parameters of a file that may come first."""
    rules = [value] if isinstance(value, str) else [rule[6:] for rule in value or [] if rule.startswith("__ns:=")]
    if rules:
        context.meta[CHOSEN] = rules[-1]
        _take_defaults(context)
    return value


def _read_parameters(context: typer.Context, rules: list[str] | None) -> list[str] | None:
    """Take the parameters of the command line: they count before those of a file."""
    context.meta[GIVEN] = {name: value for rule in rules or [] for name, value in given_parameter(rule).items()}
    _take_defaults(context)
    return rules


def _take_defaults(context: typer.Context) -> None:
    file, others = context.meta.get(FILE, (None, {}))
    given = context.meta.get(GIVEN, {})
    if file is None and not given:
        return
    known = {
        option.name: option
        for option in context.command.params
        if option.name is not None and option.name not in NOT_IN_FILES
    }
    values = {} if file is None else parameters_of(file, context.meta.get(CHOSEN), known)
    for name in {**values, **given}:
        if name not in known and name not in OF_ALL_NODES:
            expected = ", ".join(sorted("map" if one == "on" else one for one in known))
            source = "-p" if name in given else file
            raise WrongUseError(f"{source}: found the parameter {name}, expected one of {expected}")
    context.default_map = {**others, **values, **given}


@dataclass(frozen=True, slots=True)
class MapSource:
    """The source of the map, or of several, as options."""

    on: Annotated[
        list[str] | None,
        typer.Option(
            "--map",
            metavar="MAP",
            help="A map file, a folder of map files, or the id of a stored map; repeat for more maps, which are "
            "searched together. Default: the topic of --map-topic.",
        ),
    ] = None
    map_topic: Annotated[str, typer.Option(metavar="TOPIC", help="Topic of an OccupancyGrid, without --map.")] = "map"


@dataclass(frozen=True, slots=True)
class ScanSources:
    """The sources of scans and odometry, as options."""

    scan: Annotated[
        list[str] | None, typer.Option(metavar="TOPIC", help="Topic of scans; repeat for more scanners. Default: scan.")
    ] = None
    together_s: Annotated[
        float,
        typer.Option(
            metavar="SECONDS",
            min=0.0,
            max=5.0,
            help="Search scans of several topics as one if they are so close in time; 0: never.",
        ),
    ] = 0.1
    odom: Annotated[str, typer.Option(metavar="TOPIC", help="Topic of odometry.")] = "odom"
    motion: Annotated[
        bool,
        typer.Option(help="Correct the motion during a scan by its time_increment and the twist of odometry."),
    ] = True


@dataclass(frozen=True, slots=True)
class RobotNames:
    """The names of the robot's topics and frames, as options."""

    base: Annotated[str, typer.Option(metavar="FRAME", help="The base frame of the robot.")] = "base_link"
    odom_frame: Annotated[
        str, typer.Option(metavar="FRAME", help="The odometry frame, if no odometry message names it.")
    ] = "odom"
    namespace: Annotated[
        str | None,
        typer.Option(
            metavar="NAMESPACE",
            is_eager=True,
            callback=_read_namespace,
            help="Namespace of all relative topics. Default: that of the first --scan.",
        ),
    ] = None
    frame_prefix: Annotated[
        str, typer.Option(metavar="PREFIX", help="Prefix of all frames of the robot, such as robot1/.")
    ] = ""


@dataclass(frozen=True, slots=True)
class Publishing:
    """The times and contents of publishing, as options."""

    agree: Annotated[
        int,
        typer.Option(
            min=1, max=100, help="Number of scans that have to agree before a pose is published; 1: each scan."
        ),
    ] = 3
    when: Annotated[
        Literal["start", "lost", "always"],
        typer.Option(
            help="When to publish initialpose. start: at the start, on request and for "
            "new subscribers; lost: also when "
            "the localizer disagrees; always: also for each scan that confirms the pose."
        ),
    ] = "start"
    min_sigma: Annotated[
        float,
        typer.Option(
            metavar="METRES", min=0.0, max=10.0, help="Minimum standard deviation of the position in initialpose."
        ),
    ] = 0.05
    min_sigma_theta: Annotated[
        float,
        typer.Option(
            metavar="RADIANS", min=0.0, max=3.0, help="Minimum standard deviation of the heading in initialpose."
        ),
    ] = 0.0349
    publish_tf: Annotated[
        bool,
        typer.Option(
            help="Publish the transform from the map to the odometry frame. Do not use it together with AMCL."
        ),
    ] = False
    tf_max_age_s: Annotated[
        float,
        typer.Option(
            metavar="SECONDS",
            min=0.0,
            max=3600.0,
            help="Stop the transform of --publish-tf this long after the last scan with ranges; 0: never.",
        ),
    ] = 0.0
    hardware_id: Annotated[
        str, typer.Option(metavar="NAME", help="Hardware id of the diagnostics. Default: the namespace.")
    ] = ""


@dataclass(frozen=True, slots=True)
class RosArguments:
    """Parameters and remappings in the way of ROS 2, as options."""

    params_file: Annotated[
        Path | None,
        typer.Option(metavar="FILE", is_eager=True, callback=_read_params, help="A parameter file of ROS 2 (YAML)."),
    ] = None
    ros_args: Annotated[bool, typer.Option("--ros-args", help="Ignored; the options after it apply as usual.")] = False
    parameter: Annotated[
        list[str] | None,
        typer.Option(
            "--param",
            "-p",
            metavar="NAME:=VALUE",
            is_eager=True,
            callback=_read_parameters,
            help="Set a parameter, as in ROS 2.",
        ),
    ] = None
    log_level: Annotated[list[str] | None, typer.Option(metavar="LEVEL", help="Ignored, as are rosout logs.")] = None
    rosout_logs: Annotated[
        bool, typer.Option("--enable-rosout-logs/--disable-rosout-logs", hidden=True, help="Ignored.")
    ] = False
    stdout_logs: Annotated[
        bool, typer.Option("--enable-stdout-logs/--disable-stdout-logs", hidden=True, help="Ignored.")
    ] = False
    remap: Annotated[
        list[str] | None,
        typer.Option(
            "--remap",
            "-r",
            metavar="FROM:=TO",
            is_eager=True,
            callback=_read_namespace,
            help="Remap the name of a topic.",
        ),
    ] = None


@grouped
def ros2(
    source: MapSource,
    sources: ScanSources,
    names: RobotNames,
    usable: UsableOptions,
    publishing: Publishing,
    ros: RosArguments,
) -> None:
    """Subscribe to scans of ROS 2, and publish initialpose when they agree, until an interrupt.

    The domain is ROS_DOMAIN_ID; ROS_LOCALHOST_ONLY, ROS_AUTOMATIC_DISCOVERY_RANGE and CYCLONEDDS_URI apply as usual.
    """
    try:
        from ros2 import ConnectionRefusedError, Node, NodeOptions, OptionError, domain_of
    except ModuleNotFoundError:
        raise RefusedError(
            'linefix ros2 needs the extras formats and ros2: in a checkout, pip install ".[formats,ros2]"'
        ) from None

    if names.namespace is None and not any(rule.startswith("__ns:=") for rule in ros.remap or []):
        _require_one_robot(ros.params_file)
    scans = tuple(sources.scan or ("scan",))
    try:
        where, remappings = _names(scans, names.namespace, ros.remap or [])
        options = NodeOptions(
            scans=scans,
            together_s=sources.together_s,
            odometry=sources.odom,
            motion=sources.motion,
            map_topic=None if source.on else source.map_topic,
            base_frame=names.base,
            odom_frame=names.odom_frame,
            namespace=where,
            remappings=remappings,
            frame_prefix=names.frame_prefix,
            on_map=usable.on_map,
            usable_from=usable.usable_from,
            agree=publishing.agree,
            when=publishing.when,
            min_sigma=publishing.min_sigma,
            min_sigma_theta=publishing.min_sigma_theta,
            publish_tf=publishing.publish_tf,
            tf_max_age_s=publishing.tf_max_age_s,
            domain=domain_of(os.environ),
            hardware_id=publishing.hardware_id,
        )
        maps = _maps_at(source.on) if source.on else None
        node = Node(options, maps)
    except (OptionError, ConnectionRefusedError) as error:
        raise WrongUseError(str(error)) from None
    _run(node, options, maps)


def _require_one_robot(file: Path | None) -> None:
    robots = [] if file is None else robots_of(file)
    if len(robots) > 1:
        raise WrongUseError(f"{file}: found parameters of {', '.join(robots)}, expected one; add --namespace")


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
        f"subscribed to {scans} in domain {options.domain}; {source}; base frame {options.base_frame}; "
        f"{options.topic('initialpose')} when {options.agree} scans agree"
    )


def _names(scans: tuple[str, ...], namespace: str | None, rules: list[str]) -> tuple[str, dict[str, str]]:
    """Return the namespace and the remappings of topics; ``__ns`` and ``__node`` are remapped as in ROS."""
    from ros2 import checked_namespace, namespace_of, remapping_of

    remappings = dict(remapping_of(rule) for rule in rules)
    remappings.pop("__node", None)
    remapped = remappings.pop("__ns", None)
    chosen = remapped if remapped is not None else namespace
    return checked_namespace(namespace_of(scans) if chosen is None else chosen), remappings


def _maps_at(names: Sequence[str]) -> Maps:
    import linefix
    from ros2 import Maps

    documents = read_maps(names)
    frames = {name: _frame_of(document, name) for name, document in documents.items()}
    several = len(documents) > 1
    with needing_formats("a map"):
        index = linefix.index_maps(documents) if several else linefix.index_map(next(iter(documents.values())))
    return Maps(index, frames)


def _frame_of(document: Json, name: str) -> str:
    frame = document.get("frame_id") or "map"
    if not (isinstance(frame, str) and frame.isprintable() and len(frame) <= MAX_FRAME):
        raise RefusedError(
            f"{name}: found a frame_id that is not a name, expected at most "
            f"{MAX_FRAME} printable characters; correct it in the map file"
        )
    return frame
