"""The one table that turns exceptions into problems."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from association import CancelledError
from registration import InputError

from ..schemas.strict import TooLargeError
from .problems import Fault, ProblemError, invalid


def _of_library(error: InputError) -> ProblemError:
    # The libraries name arguments as the contract does, with dots.
    pointer = "/" + error.argument.replace(".", "/")
    if error.index is not None:
        pointer += f"/{error.index}"
    return invalid([Fault(pointer, error.message)])


def _of_size(error: TooLargeError) -> ProblemError:
    return ProblemError("too_large", error.detail, [Fault(error.pointer, error.detail)] if error.pointer else ())


# The table. First match wins; whatever is not listed is a defect.
_TABLE: tuple[tuple[type[Exception], Callable[[Any], ProblemError]], ...] = (
    (ProblemError, lambda error: error),
    (TooLargeError, _of_size),
    (InputError, _of_library),
    (CancelledError, lambda _: ProblemError("not_ready", "the service is going down")),
)


def problem_of(error: Exception) -> ProblemError | None:
    """Return the problem that an exception stands for, or None for a defect."""
    for kind, translate in _TABLE:
        if isinstance(error, kind):
            return translate(error)
    return None
