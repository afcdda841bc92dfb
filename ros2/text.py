"""Text that comes from outside, shortened and without control characters, as it may stand in a message."""

from __future__ import annotations

MAX_NAME = 255  # characters of a frame or a topic, as ROS limits topics
SHOWN = 60  # characters of a name in a message


def quoted(name: str) -> str:
    """Return a name in quotation marks; what cannot be printed is replaced, and a long name is cut."""
    shown = "".join(letter if letter.isprintable() else "?" for letter in name[: SHOWN + 1])
    return f'"{shown[:SHOWN]}..."' if len(name) > SHOWN else f'"{shown}"'
