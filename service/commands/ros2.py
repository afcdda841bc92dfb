"""``linefix ros2``: scans in and poses out over DDS, as robots with ROS 2 speak it."""

from __future__ import annotations

import os
import signal
import sys
from typing import Annotated, Any, Literal

import typer

from ..work.warmup import warm_up
from .errors import RefusedError, WrongUseError
from .inputs import document_at, needing_formats

LEAST_DOMAIN, MOST_DOMAIN = 0, 232
MAX_FRAME = 255  # characters


def ros2(
    on: Annotated[
        str | None,
        typer.Option("--map", metavar="MAP", help="A map file, or the id of a stored map; else it comes over a topic."),
    ] = None,
    map_topic: Annotated[
        str | None,
        typer.Option(metavar="TOPIC", help="Topic of an OccupancyGrid, without --map. Default: map of the namespace."),
    ] = None,
    scan: Annotated[list[str] | None, typer.Option(metavar="TOPIC", help="Of scans; may be given again.")] = None,
    together: Annotated[
        float,
        typer.Option(
            metavar="SECONDS",
            min=0.0,
            max=5.0,
            help="Scans of several topics so near in time are one; 0: each by itself.",
        ),
    ] = 0.1,
    odom: Annotated[
        str | None,
        typer.Option(metavar="TOPIC", help="Topic of odometry: how the robot moves. Default: odom of the namespace."),
    ] = None,
    motion: Annotated[
        bool, typer.Option(help="Take each beam to where the scanner was, by time_increment and the twist of --odom.")
    ] = True,
    base: Annotated[str, typer.Option(metavar="FRAME", help="The robot's own frame.")] = "base_link",
    when: Annotated[
        Literal["lost", "always"],
        typer.Option(help="When to say /initialpose: by the first usable scan and when asked; or by each."),
    ] = "lost",
) -> None:
    """Subscribe to scans of ROS 2 and publish /initialpose; ends with an interrupt.

    The namespace is that of the first scan topic: for /robot1/scan all topics but /diagnostics are in /robot1.
    The domain is ROS_DOMAIN_ID, what else DDS needs CYCLONEDDS_URI.
    """
    try:
        from bridge import Bridge, BridgeOptions, namespace_of
    except ModuleNotFoundError:
        raise RefusedError('linefix ros2 needs more packages: pip install "linefix[formats,ros2]"') from None
    import linefix

    scans = tuple(scan or ("/scan",))
    namespace = namespace_of(scans)
    options = BridgeOptions(
        scans=scans,
        together=together,
        odometry=odom or f"{namespace}/odom",
        motion=motion,
        map_topic=None if on else map_topic or f"{namespace}/map",
        base_frame=base,
        when=when,
        domain=_domain(),
    )
    index, frame = None, "map"
    if on is not None:
        document = document_at(on, None)
        with needing_formats(on):
            segments = linefix.Segments.from_array(document.get("segments", []), argument="map.segments")
            oriented = document.get("oriented", True)
            index = linefix.MapIndex.build(segments, document.get("sigma"), oriented=oriented)
        frame = _frame_of(document)
    warm_up()  # or the first scans would wait for it
    bridge = Bridge(options, index, frame)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: bridge.end())
    print(f"linefix: listening to {', '.join(options.scans)} in domain {options.domain}", file=sys.stderr, flush=True)
    bridge.run()
    if not bridge.close():
        sys.stderr.flush()
        os._exit(0)  # a search does not end in time, and Python would wait for it


def _domain() -> int:
    told = os.environ.get("ROS_DOMAIN_ID") or "0"
    if not (told.isdigit() and LEAST_DOMAIN <= int(told) <= MOST_DOMAIN):
        raise WrongUseError(f"ROS_DOMAIN_ID: expected {LEAST_DOMAIN} to {MOST_DOMAIN}, got {told}")
    return int(told)


def _frame_of(document: dict[str, Any]) -> str:
    frame = document.get("frame_id") or "map"
    if not (isinstance(frame, str) and frame.isprintable() and len(frame) <= MAX_FRAME):
        raise RefusedError(f"the map's frame_id: expected a name of at most {MAX_FRAME} characters, such as map")
    return frame
