"""What makes it quicker to compile many kernels in one process.

Numba works out anew what ``a * b`` makes of two numbers wherever it is written, of some twenty ways to multiply things.
Here that is remembered for a function and the types it is handed, on which alone it depends: a fifth of a first start.
How Numba finds types is its own affair, so that this, too, is written for the versions that the project names.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from numba.core.types.functions import BaseFunction

SELDOM = (20_000, 20, 50)  # when to look for unreachable cycles: of what a compiler makes little is garbage


@contextmanager
def compiling_many() -> Iterator[None]:
    """Compile with Numba in less time until the block ends, and take some memory for it."""
    look_up, thresholds = BaseFunction.get_call_type, gc.get_threshold()
    known: dict[Any, Any] = {}

    def remembered(function: Any, context: Any, args: Any, kws: Any) -> Any:
        if kws:
            return look_up(function, context, args, kws)
        asked = (context, function, args)
        if asked not in known:
            known[asked] = look_up(function, context, args, kws)
        return known[asked]

    BaseFunction.get_call_type = remembered  # type: ignore[assignment, method-assign]
    gc.set_threshold(*SELDOM)
    try:
        yield
    finally:
        BaseFunction.get_call_type = look_up  # type: ignore[method-assign]
        gc.set_threshold(*thresholds)
