"""``linefix ros2``: scans in and poses out over DDS, as robots with ROS 2 speak it."""

from __future__ import annotations

import os
import signal
import sys
from typing import Annotated, Literal

import typer

from ..work.warmup import warm_up
from .errors import RefusedError, WrongUseError
from .inputs import document_at, needing_formats

LEAST_DOMAIN, MOST_DOMAIN = 0, 232


def ros2(
    on: Annotated[
        str | None,
        typer.Option("--map", metavar="MAP", help="A map file, or the id of a stored map; else it comes over a topic."),
    ] = None,
    map_topic: Annotated[str, typer.Option(metavar="TOPIC", help="Of an OccupancyGrid, without --map.")] = "/map",
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
    odom: Annotated[str, typer.Option(metavar="TOPIC", help="Of odometry: how the robot moves.")] = "/odom",
    motion: Annotated[
        bool, typer.Option(help="Take each beam to where the scanner was, by time_increment and the twist of --odom.")
    ] = True,
    base: Annotated[str, typer.Option(metavar="FRAME", help="The robot's own frame.")] = "base_link",
    when: Annotated[
        Literal["lost", "always"],
        typer.Option(help="When to say /initialpose: by the first usable scan and when asked; or by each."),
    ] = "lost",
) -> None:
    """Listen to scans of ROS 2 and say /initialpose; ends with an interrupt.

    The domain is ROS_DOMAIN_ID, what else DDS needs CYCLONEDDS_URI.
    """
    try:
        from bridge import Bridge, BridgeOptions
    except ModuleNotFoundError:
        raise RefusedError('linefix ros2 needs more packages: pip install "linefix[formats,ros2]"') from None
    import linefix

    options = BridgeOptions(
        scans=tuple(scan or ("/scan",)),
        together=together,
        odometry=odom,
        motion=motion,
        map_topic=None if on else map_topic,
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
        frame = document.get("frame_id", "map")
    warm_up()  # or the first scans would wait for it
    bridge = Bridge(options, index, frame)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: bridge.end())
    print(f"linefix: listening to {', '.join(options.scans)} in domain {options.domain}", file=sys.stderr, flush=True)
    bridge.run()


def _domain() -> int:
    told = os.environ.get("ROS_DOMAIN_ID") or "0"
    if not (told.isdigit() and LEAST_DOMAIN <= int(told) <= MOST_DOMAIN):
        raise WrongUseError(f"ROS_DOMAIN_ID: expected {LEAST_DOMAIN} to {MOST_DOMAIN}, got {told}")
    return int(told)
