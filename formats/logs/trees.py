"""The transform trees of a bag: one for each namespace, since robots that share a bag share names of frames."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from typing import Any

from ..errors import IncompleteFileError, MalformedFileError
from ..report import Notes, shown
from .bags import ODOMETRY, OLD_TRANSFORMS, SCAN, TRANSFORMS, Bag
from .tracks import Floats, Track
from .transforms import Transforms, matrix_of, stamp_of

STATIC, MOVING = "tf_static", "tf"
ODOM = "odom"


def namespace_of(topic: str) -> str:
    """Return what stands before the last part of a topic, such as ``/robot1``; empty for ``/scan``."""
    namespace = topic.strip("/").rpartition("/")[0]
    return f"/{namespace}" if namespace else ""


def within(topic: str, namespace: str) -> bool:
    """Tell whether a topic lies in a namespace, or in one below it."""
    return f"/{topic.strip('/')}".startswith(f"{namespace}/")


@dataclass(frozen=True, slots=True)
class OdometryTopic:
    """The poses in the Odometry messages of one topic.

    Attributes
    ----------
    topic : str
    outer : str
        Frame that the poses are in.
    child : str
        Frame whose poses they are; empty where the messages do not name it.
    track : Track
        outer_from_child.
    """

    topic: str
    outer: str
    child: str
    track: Track


@dataclass(slots=True)
class BagFrames:
    """The transforms and the odometry of a bag.

    Attributes
    ----------
    scans : tuple of str
        All topics of scans.
    trees : dict
        By the namespace of their topics; empty for ``/tf`` and ``/tf_static``.
    odometry : list of OdometryTopic
    """

    scans: tuple[str, ...]
    trees: dict[str, Transforms] = field(default_factory=dict)
    odometry: list[OdometryTopic] = field(default_factory=list)

    def tree(self, topic: str, frame: str, wanted: str | None, notes: Notes) -> tuple[str, Transforms]:
        """Return the tree that a topic's scans belong to, with its namespace; an empty tree where there is none.

        Parameters
        ----------
        topic, frame : str
            Of the scans.
        wanted : str or None
            Namespace that the user has chosen; None: that of the topic, else the one around it, and so on.
        notes : Notes

        Raises
        ------
        IncompleteFileError
            When the chosen one is not there, or it is not clear which one it is.
        """
        if wanted is not None:
            return self._wanted(wanted)
        own = sorted((one for one in self.trees if within(topic, one)), key=len, reverse=True)
        holding = [one for one in own if self.trees[one].knows(frame)]
        others = sorted(one for one in self.trees if one not in own and self.trees[one].knows(frame))
        # The tree of another robot is not used where the topic has one of its own.
        if holding or (own and (own[0] or not others)) or not others:
            chosen = (holding or own or [""])[0]
            return chosen, self.trees.get(chosen) or Transforms()
        if len(others) > 1 or namespace_of(topic):
            raise IncompleteFileError(
                f"the namespace of the transforms is ambiguous for {shown(topic)}, with its frame {shown(frame)}: "
                f"those in {_listed(others)}; choose one with the option tf_namespace (--tf-namespace "
                f"{shown(others[0])})"
            )
        notes.add_assumed("tf_namespace", f"the transforms of {shown(others[0])} hold for {shown(topic)}")
        return others[0], self.trees[others[0]]

    def _wanted(self, wanted: str) -> tuple[str, Transforms]:
        named = f"/{wanted.strip('/')}" if wanted.strip("/") else ""
        for chosen in (named, namespace_of(named)):
            if chosen in self.trees:
                return chosen, self.trees[chosen]
        raise IncompleteFileError(
            f"has no transforms in {shown(named or '/')}, only in {_listed(self.trees) or 'none'}"
        )

    def odometry_of(self, topic: str, namespace: str, frames: Collection[str], base: str | None) -> list[OdometryTopic]:
        """Return the Odometry that may be of the robot with a scanner, the likeliest first.

        Parameters
        ----------
        topic, namespace : str
            Of the scans, and of the tree that they belong to.
        frames : collection of str
            From the sensor outwards; Odometry is of one of them.
        base : str or None
            The one that messages without a `child_frame_id` are of.
        """
        homes = [one for one in (_first(topic), namespace and _first(f"{namespace}/tf")) if one]

        def home(one: OdometryTopic) -> bool:
            return any(within(one.topic, namespace) for namespace in homes)

        def foreign(one: OdometryTopic) -> bool:
            first = _first(one.topic)
            used = (*self.scans, *(f"{tree}/{MOVING}" for tree in self.trees))
            return bool(first) and not home(one) and any(within(other, first) for other in used)

        fitting = [one for one in self.odometry if (one.child or base) in frames and not foreign(one)]
        return sorted(fitting, key=lambda one: (not home(one), not one.topic.endswith(f"/{ODOM}"), -len(one.track)))


def read_frames(bag: Bag, notes: Notes) -> BagFrames:
    """Read transforms and odometry of a bag; those that are none are left out, and counted.

    Raises
    ------
    FormatError
        When the bag is broken, or has too many transforms.
    """
    scans = tuple(sorted({one.topic for one in bag.connections(SCAN)}))
    frames = BagFrames(scans)
    namespaces = _namespaces(bag)
    # Global transforms are of the same robot if all scans lie in one namespace.
    single = {one for one in namespaces.values() if one}
    merged = len(single) == 1 and all(within(topic, next(iter(single))) for topic in scans)
    wanted = [one for one in bag.connections(TRANSFORMS, OLD_TRANSFORMS) if one.topic in namespaces]
    for connection, received, message in bag.received(wanted):
        namespace = next(iter(single)) if merged else namespaces[connection.topic]
        tree = frames.trees.setdefault(namespace, Transforms())
        for one in message.transforms:
            _add(tree, connection.topic, received, one, notes)
        notes.add_read("transforms", "messages of tf", 1)
    frames.odometry += _odometry(bag, notes)
    for tree in frames.trees.values():
        _note_doubts(tree, notes)
    return frames


def _namespaces(bag: Bag) -> dict[str, str]:
    """Return the namespace of each topic of transforms; topics of other names count where there is no ``tf``."""
    topics = {one.topic for one in bag.connections(TRANSFORMS, OLD_TRANSFORMS)}
    named = {one: namespace_of(one) for one in topics if one.rpartition("/")[2] in (STATIC, MOVING)}
    moving = {namespace for topic, namespace in named.items() if topic.rpartition("/")[2] == MOVING}
    return named | {one: namespace_of(one) for one in topics - set(named) if namespace_of(one) not in moving}


def _odometry(bag: Bag, notes: Notes) -> Iterable[OdometryTopic]:
    found: dict[tuple[str, str, str], OdometryTopic] = {}
    for connection, received, message in bag.received(bag.connections(ODOMETRY)):
        pose, child = message.pose.pose, message.child_frame_id.strip("/")
        matrix = _matrix(pose.position, pose.orientation, f"odometry on {connection.topic}", notes)
        if matrix is None:
            continue
        key = (connection.topic, message.header.frame_id.strip("/") or ODOM, child)
        if key not in found:
            found[key] = OdometryTopic(*key, Track(static=False))
        found[key].track.add(stamp_of(message.header), matrix, received=received, topic=connection.topic)
        notes.add_read("odometry", "messages of odometry", 1)
    return found.values()


def _matrix(position: Any, orientation: Any, what: str, notes: Notes) -> Floats | None:
    try:
        return matrix_of(position, orientation)
    except ValueError as error:
        notes.add_dropped("broken_transform", f"invalid transforms, the last one {shown(what)}: {error}", 1)
        return None


def _add(tree: Transforms, topic: str, received: int, one: Any, notes: Notes) -> None:
    parent, child, transform = one.header.frame_id, one.child_frame_id, one.transform
    matrix = _matrix(transform.translation, transform.rotation, f"{parent} to {child}", notes)
    if matrix is None:
        return
    static = topic.rpartition("/")[2] == STATIC
    try:
        tree.add(parent, child, stamp_of(one.header), matrix, static=static, received=received, topic=topic)
    except MalformedFileError as error:
        what = f"{shown(parent) or 'a frame without a name'} to {shown(child) or 'a frame without a name'}"
        notes.add_dropped("broken_frame", f"invalid transforms, the last one {what}: {error.message}", 1)


def _note_doubts(tree: Transforms, notes: Notes) -> None:
    """Note the frames with several parents, and static transforms that change."""
    several = [frame for frame in tree.frames() if len(tree.parents(frame)) > 1]
    if several:
        told = "; ".join(f"{shown(one)} in {_listed(tree.parents(one))}" for one in several[:3])
        notes.add_assumed("several_parents", f"frames with several parents, of which one is used: {told}")
    ways = [(parent, child) for child in tree.frames() for parent in tree.parents(child)]
    for parent, child in (way for way in ways if tree.track(*way).refixed):
        notes.add_assumed(
            "fixed_again",
            f"{shown(child)} is fixed in {shown(parent)} at different places; each scan uses the last one before it",
        )


def _first(topic: str) -> str:
    """Return the outermost namespace of a topic; empty for ``/odom``."""
    first, _, rest = topic.strip("/").partition("/")
    return f"/{first}" if rest else ""


def _listed(names: Iterable[str]) -> str:
    return ", ".join(shown(name or "/") for name in names)
