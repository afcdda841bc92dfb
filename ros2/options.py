"""Names of topics as ROS resolves them, and the options of the node."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

MAX_NAME = 255  # characters of a frame or a topic, as ROS limits topics
SHOWN = 60  # characters of a name in a message
_TOPIC = re.compile(r"[~/]?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")


class OptionError(ValueError):
    """An option cannot be used; the message names it, the value found, and the value expected."""


def quoted(name: str) -> str:
    """Return a name in quotation marks; what cannot be printed is replaced, and a long name is cut."""
    shown = "".join(letter if letter.isprintable() else "?" for letter in name[: SHOWN + 1])
    return f'"{shown[:SHOWN]}..."' if len(name) > SHOWN else f'"{shown}"'


def namespace_of(scans: Sequence[str]) -> str:
    """Return the namespace that absolute topics of scans have: ``/robot1`` for ``/robot1/scan``, else empty."""
    above = scans[0].rpartition("/")[0] if scans and scans[0].startswith("/") else ""
    return above.rstrip("/")


def absolute_name(name: str, namespace: str) -> str:
    """Return a topic's name with its namespace, as ROS expands it; ``~/`` stands for the node ``linefix``.

    Raises
    ------
    OptionError
        When it is no name of a topic.
    """
    if not _TOPIC.fullmatch(name.replace("~/", "~", 1)) or len(name) > MAX_NAME:
        raise OptionError(f"found the topic {name[:80]!r}, expected a name such as /robot1/scan")
    if name.startswith("/"):
        return name
    inner = f"linefix/{name[2:]}" if name.startswith("~/") else name
    return f"{namespace}/{inner}"


def checked_namespace(namespace: str) -> str:
    """Return a namespace as ``/robot1``, or empty for the root.

    Raises
    ------
    OptionError
        When it is none.
    """
    inner = namespace.strip("/")
    return absolute_name(f"/{inner}", "") if inner else ""


def remapping_of(rule: str) -> tuple[str, str]:
    """Return both names of a remapping, ``from:=to``.

    Raises
    ------
    OptionError
        When it is none.
    """
    begin, found, end = rule.partition(":=")
    if not found or not begin or not end:
        raise OptionError(f"found the remapping {rule[:80]!r}, expected FROM:=TO, such as scan:=/front/scan")
    return begin, end


When = Literal["start", "lost", "always"]


@dataclass(frozen=True, slots=True)
class NodeOptions:
    """Topics and frames of one robot, and when its pose is published.

    Names of topics without a leading slash are in `namespace`; remappings hold for all.

    Attributes
    ----------
    scans : tuple of str
        Topics of scans.
    together_s : float
        Seconds; scans of several topics that are taken no farther apart are searched as one. 0: each separately.
    odom : str
        Topic of odometry: the motion of the robot between scans, and during each.
    motion : bool
        Take every beam to where the scanner was, where a scan has a `time_increment` and odometry a twist; without the
        twist the covariance is wider. False: scans are taken as they are.
    map_topic : str or None
        Of an OccupancyGrid, for a node that was given no map.
    base, odom_frame : str
        Without `frame_prefix`.
    namespace : str
        Of the robot, such as ``/robot1``; empty: none.
    remappings : mapping of str to str
        Of names of topics.
    frame_prefix : str
        That all frames of the robot begin with, such as ``robot1/``.
    on_map : float
        Prior probability that a scan was taken on the map, or on one of the maps; 0.5 to 1.
    usable_from : float
        Least probability of a usable answer, 0.5 to 0.9999.
    agree : int
        Scans that have to agree before a pose is published; 1: each usable scan alone.
    when : "start", "lost" or "always"
        When ``initialpose`` is published: at the start, on request and for new subscribers; also when the localizer of
        the robot disagrees; or for each scan that confirms the pose.
    min_sigma, min_sigma_theta : float
        Least standard deviations of ``initialpose``, metres and radians: less collapses the particles of AMCL.
    publish_tf : bool
        Publish the transform from the map to `odom_frame`.
    tf_max_age_s : float
        Stop the transform this long after the last scan with ranges, seconds; 0: never.
    surface : float or None
        Depth of the walls' surface behind the front of the occupied cells of an OccupancyGrid, cells; None: estimated.
    use_sim_time : bool
        Ages of inputs, and stamps of diagnostics, are those of ``/clock``.
    domain : int
        ``ROS_DOMAIN_ID``.
    hardware_id : str
        Of the diagnostics.
    """

    scans: tuple[str, ...] = ("scan",)
    together_s: float = 0.1
    odom: str = "odom"
    motion: bool = True
    map_topic: str | None = None
    base: str = "base_link"
    odom_frame: str = "odom"
    namespace: str = ""
    remappings: Mapping[str, str] = field(default_factory=dict)
    frame_prefix: str = ""
    on_map: float = 0.9
    usable_from: float = 0.95
    agree: int = 3
    when: When = "start"
    min_sigma: float = 0.05
    min_sigma_theta: float = 0.0349  # 2 degrees
    publish_tf: bool = False
    tf_max_age_s: float = 0.0
    surface: float | None = None
    use_sim_time: bool = False
    domain: int = 0
    hardware_id: str = ""

    def topic(self, name: str) -> str:
        """Return the absolute name of a topic: in the namespace where it is relative, and remapped."""
        absolute = absolute_name(name, self.namespace)
        for begin, end in self.remappings.items():
            if absolute_name(begin, self.namespace) == absolute:
                return absolute_name(end, self.namespace)
        return absolute

    @property
    def prefix(self) -> str:
        """The prefix of the robot's frames on topics that robots share: `frame_prefix`, else the namespace."""
        return self.frame_prefix or (f"{self.namespace.strip('/')}/" if self.namespace else "")

    def frame(self, frame: str) -> str:
        """Return the frame of a scan as the tree of frames has it."""
        frame = frame.strip("/")
        return frame if not frame or frame.startswith(self.frame_prefix) else f"{self.frame_prefix}{frame}"

    def base_of(self, frame: str) -> str:
        """Return the base frame for a scan in a frame: with the prefix where the frame has it."""
        base = self.base.strip("/")
        prefixed = bool(self.prefix) and frame.startswith(self.prefix)
        return f"{self.prefix}{base}" if prefixed and not base.startswith(self.prefix) else base
