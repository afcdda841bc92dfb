"""``linefix ros2``: scans in and poses out over DDS, for robots with ROS 2."""

from __future__ import annotations

import math
import os
import signal
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from service.work.warmup import warm_up

from .asking import document_at
from .errors import RefusedError, WrongUseError
from .inputs import needing_formats
from .options import grouped

if TYPE_CHECKING:
    import linefix
    from ros2 import NodeOptions

MAX_FRAME = 255  # characters
MAX_PARAMETERS = 65_536  # characters of a file of parameters
NODE = "linefix"  # the name of the node in parameter files
NOT_IN_FILES = ("params_file", "ros_args", "remap", "parameter", "help")


def _read_params(context: typer.Context, file: Path | None) -> Path | None:
    """Take the parameters of a file as defaults: what stands on the command line counts before them."""
    if file is not None:
        known = {
            option.name: option
            for option in context.command.params
            if option.name is not None and option.name not in NOT_IN_FILES
        }
        values = parameters_of(file)
        for name in values:
            if name not in known:
                raise WrongUseError(f"{file}: found the parameter {name}, expected one of {', '.join(sorted(known))}")
        context.default_map = {**(context.default_map or {}), **values}
    return file


@dataclass(frozen=True, slots=True)
class MapSource:
    """The source of the map, as options."""

    on: Annotated[
        str | None,
        typer.Option(
            "--map", metavar="MAP", help="A map file, or the id of a stored map. Default: the topic of --map-topic."
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
        typer.Option(metavar="NAMESPACE", help="Namespace of all relative topics. Default: that of the first --scan."),
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
    ] = round(math.radians(2.0), 4)
    publish_tf: Annotated[
        bool,
        typer.Option(
            help="Publish the transform from the map to the odometry frame. Do not use it together with AMCL."
        ),
    ] = False
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
    remap: Annotated[
        list[str] | None, typer.Option("--remap", "-r", metavar="FROM:=TO", help="Remap the name of a topic.")
    ] = None


@grouped
def ros2(source: MapSource, sources: ScanSources, names: RobotNames, publishing: Publishing, ros: RosArguments) -> None:
    """Subscribe to scans of ROS 2, and publish initialpose when they agree, until an interrupt.

    The domain is ROS_DOMAIN_ID; ROS_LOCALHOST_ONLY, ROS_AUTOMATIC_DISCOVERY_RANGE and CYCLONEDDS_URI apply as usual.
    """
    try:
        from ros2 import ConnectionRefusedError, Node, NodeOptions, OptionError, domain_of
    except ModuleNotFoundError:
        raise RefusedError(
            'linefix ros2 needs the extras formats and ros2: in a checkout, pip install ".[formats,ros2]"'
        ) from None

    on = source.on
    scans = tuple(sources.scan or ("scan",))
    try:
        where, remappings = _names(scans, names.namespace, ros.remap or [])
        options = NodeOptions(
            scans=scans,
            together_s=sources.together_s,
            odometry=sources.odom,
            motion=sources.motion,
            map_topic=None if on else source.map_topic,
            base_frame=names.base,
            odom_frame=names.odom_frame,
            namespace=where,
            remappings=remappings,
            frame_prefix=names.frame_prefix,
            agree=publishing.agree,
            when=publishing.when,
            min_sigma=publishing.min_sigma,
            min_sigma_theta=publishing.min_sigma_theta,
            publish_tf=publishing.publish_tf,
            domain=domain_of(os.environ),
            hardware_id=publishing.hardware_id,
        )
        index, frame = (None, "map") if on is None else _map_at(on)
        node = Node(options, index, frame)
    except (OptionError, ConnectionRefusedError) as error:
        raise WrongUseError(str(error)) from None
    _run(node, options, on)


def _run(node: Any, options: NodeOptions, on: str | None) -> None:
    warm_up()  # or the first scans would wait for it
    node.wait_until_ready()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: node.end())
    print(f"linefix: {_started(options, on)}", file=sys.stderr, flush=True)
    node.run()
    if not node.close():
        sys.stderr.flush()
        os._exit(0)  # a search does not end in time, and Python would wait for it


def _started(options: NodeOptions, on: str | None) -> str:
    scans = ", ".join(options.topic(name) for name in options.scans)
    source = on if on is not None else f"the topic {options.topic(options.map_topic or 'map')}"
    return (
        f"subscribed to {scans} in domain {options.domain}; map from {source}; base frame {options.base_frame}; "
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


def _map_at(name: str) -> tuple[linefix.MapIndex, str]:
    import linefix

    document = document_at(name, None)
    with needing_formats(name):
        index = linefix.index_map(document)
    frame = document.get("frame_id") or "map"
    if not (isinstance(frame, str) and frame.isprintable() and len(frame) <= MAX_FRAME):
        raise RefusedError(
            f"{name}: found a frame_id that is not a name, expected at most "
            f"{MAX_FRAME} printable characters; correct it in the map file"
        )
    return index, frame


def parameters_of(file: Path) -> dict[str, Any]:
    """Return the parameters of a file: those of the node ``linefix``, in any namespace, and of ``/**``.

    Raises
    ------
    WrongUseError
        When there is no such file, or it is no file of parameters.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    expected = f"expected {NODE}: ros__parameters: name: value"
    try:
        with file.open(encoding="utf-8") as stream:
            text = stream.read(MAX_PARAMETERS + 1)
        if len(text) > MAX_PARAMETERS or "<<" in text:
            raise WrongUseError(f"{file}: {expected}, in at most {MAX_PARAMETERS} characters without merge keys")
        document = YAML(typ="safe").load(text)
    except OSError as error:
        raise WrongUseError(f"{file}: {error.strerror}") from None
    except (YAMLError, ValueError, RecursionError):
        raise WrongUseError(f"{file}: not YAML; {expected}") from None
    if not isinstance(document, dict):
        raise WrongUseError(f"{file}: {expected}")
    values: dict[str, Any] = {}
    found = False
    for name, inner in document.items():
        if str(name).strip("/").rpartition("/")[2] in (NODE, "**") and isinstance(inner, dict):
            parameters = inner.get("ros__parameters")
            if isinstance(parameters, dict):
                found = True
                values.update({str(key): value for key, value in parameters.items()})
    if not found:
        raise WrongUseError(f"{file}: {expected}")
    return {("on" if key == "map" else key): value for key, value in values.items() if value is not None}
