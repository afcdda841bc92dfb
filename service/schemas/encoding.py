"""The last look at what leaves: JSON has no NaN, and orjson would quietly write null."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import orjson


class NotFiniteError(ArithmeticError):
    """A defect: an answer holds a number that is not finite."""


def require_finite(value: Any) -> None:
    """Raise `NotFiniteError` when there is a NaN or infinity anywhere in an answer."""
    if isinstance(value, float):
        if not math.isfinite(value):
            raise NotFiniteError("an answer holds a number that is not finite")
    elif isinstance(value, dict):
        for item in value.values():
            require_finite(item)
    elif isinstance(value, list | tuple):
        for item in value:
            require_finite(item)
    elif isinstance(value, np.ndarray) and value.dtype.kind == "f" and not np.isfinite(value).all():
        raise NotFiniteError("an answer holds an array that is not finite")


def encode(answer: Any) -> bytes:
    """Return an answer as JSON.

    Raises
    ------
    NotFiniteError
        When it holds a number that is not finite.
    """
    require_finite(answer)
    return orjson.dumps(answer, option=orjson.OPT_SERIALIZE_NUMPY)
