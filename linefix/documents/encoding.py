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
    if isinstance(value, float):
        if not math.isfinite(value):
            raise NotFiniteError("an answer holds a number that is not finite")
    elif isinstance(value, dict):
        _require_all_finite(value.values())
    elif isinstance(value, list | tuple):
        _require_all_finite(value)
    elif isinstance(value, np.ndarray) and value.dtype.kind == "f" and not np.isfinite(value).all():
        raise NotFiniteError("an answer holds an array that is not finite")


def _require_all_finite(values: Iterable[Any]) -> None:
    # Most of what is in an answer is a number or a name: these are looked at here, without a call for each.
    for value in values:
        if type(value) is float:
            if not math.isfinite(value):
                raise NotFiniteError("an answer holds a number that is not finite")
        elif type(value) not in _PLAIN:
            require_finite(value)


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
