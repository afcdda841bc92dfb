"""Names of topics as ROS resolves them, and names from outside as they may stand in a message."""

from __future__ import annotations

import re
from collections.abc import Sequence

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
