"""Many functions are compiled in less time, and to the same."""

from __future__ import annotations

import gc
import math
from contextlib import suppress
from typing import Any

import pytest
from numba import njit
from numba.core.errors import TypingError
from numba.core.types.functions import BaseFunction

from registration.many_kernels import compiling_many

compiled: Any = njit


def _both(x: float, n: float) -> float:
    return x * n + math.sqrt(x) * (n // 2) - float(n) ** 2 + (x > n)


def test_what_comes_of_it_is_the_same() -> None:
    with compiling_many():
        # Twice: the second time everything is known.
        found = [compiled(_both)(*given) for _ in range(2) for given in ((2.5, 7), (3, 4), (2.0, 0.5))]
    assert found == 2 * [_both(2.5, 7), _both(3, 4), _both(2.0, 0.5)]


def test_types_are_looked_up_once(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    look_up = BaseFunction.get_call_type

    def counted(function: Any, *given: Any) -> Any:
        asked.append(function)
        return look_up(function, *given)

    monkeypatch.setattr(BaseFunction, "get_call_type", counted)
    with compiling_many():
        compiled(_both)(2.5, 7)
        once = len(asked)
        compiled(_both)(2.5, 7)
        assert 0 < once == len(asked)


def test_what_has_no_type_is_told_each_time() -> None:
    with compiling_many():
        for _ in range(2):
            with pytest.raises(TypingError, match="No implementation"):
                compiled(lambda x: x + "a")(1.0)


def test_it_ends_with_the_block() -> None:
    before = BaseFunction.get_call_type, gc.get_threshold()
    with suppress(ZeroDivisionError), compiling_many():
        assert before[0] is not BaseFunction.get_call_type
        assert before[1] != gc.get_threshold()
        raise ZeroDivisionError
    assert before == (BaseFunction.get_call_type, gc.get_threshold())
