"""The last look at what leaves: JSON has no NaN, and orjson would quietly write null."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import islice
from typing import Any

import numpy as np
import orjson

_PLAIN = frozenset((bool, int, str, type(None)))
BLOCK = 2000  # items of a long list that are objects at one time


class NotFiniteError(ArithmeticError):
    """A defect: an answer holds a number that is not finite."""


def require_finite(value: Any) -> None:
    """Raise `NotFiniteError` when there is a NaN or infinity anywhere in an answer."""
    if isinstance(value, np.ndarray):
        value = [] if value.dtype.kind != "f" or np.isfinite(value).all() else [math.nan]
    if isinstance(value, dict):
        value = value.values()
    elif not isinstance(value, list | tuple):
        value = (value,) if isinstance(value, float) else ()
    # Most of what is in an answer is a number or a name: these are looked at here, without a call for each.
    for one in value:
        if isinstance(one, float):
            if not math.isfinite(one):
                raise NotFiniteError("an answer holds a number that is not finite")
        elif type(one) not in _PLAIN:
            require_finite(one)


def encode(answer: Any) -> bytes:
    """Return an answer as JSON.

    Raises
    ------
    NotFiniteError
        When it holds a number that is not finite.
    """
    require_finite(answer)
    return orjson.dumps(answer, option=orjson.OPT_SERIALIZE_NUMPY)


def encode_list(items: Iterable[Any]) -> orjson.Fragment:
    """Return a list as JSON to be put into an answer; as objects its items take ten times the room, all at once.

    Raises
    ------
    NotFiniteError
        When it holds a number that is not finite.
    """
    coming = iter(items)
    blocks = [encode(block)[1:-1] for block in iter(lambda: list(islice(coming, BLOCK)), [])]
    return orjson.Fragment(b"[" + b",".join(blocks) + b"]")
