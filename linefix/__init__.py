"""Linefix in Python, without HTTP: where in a map of wall segments a scan was taken, and how sure that is.

>>> import linefix
>>> room = [[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]]
>>> seen = [[-1, 1, -1, -5], [-1, -5, 1, -5], [1, -5, 1, -3], [1, -3, 4, -3], [4, -3, 4, 1], [4, 1, -1, 1]]
>>> answer = linefix.locate(room, seen)
>>> answer.usable
True

Metres, radians, counter-clockwise. The packages next to this one hold everything; this one names the parts that most
programs need. The readers and writers of files come with the extra ``linefix[formats]``.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .public import *  # noqa: F403


def __getattr__(name: str) -> Any:
    """Import the libraries on first use: documents and the command line start without them."""
    return getattr(importlib.import_module("linefix.public"), name)


def __dir__() -> list[str]:
    return list(importlib.import_module("linefix.public").__all__)
