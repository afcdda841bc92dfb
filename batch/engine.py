"""Engines: they call a function for each of many items, in workers."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")

ATTEMPTS = 3  # at an item, if its workers end early


@dataclass(frozen=True, slots=True)
class Lost:
    """Instead of a result: each worker that had the item ended before it was done."""


class Engine(Protocol):
    """Calls a function for many items.

    An item whose worker ends early is done again, up to `ATTEMPTS` times.
    """

    def run(self, function: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[tuple[Item, Result | Lost]]:
        """Yield each item once with its result, as they are done.

        Parameters
        ----------
        function : callable
            Importable by its name, without side effects that a second call would spoil.
        items : sequence
            Can be pickled.

        Raises
        ------
        WorkerError
            When the function raised; then nothing more is done.
        """
        ...


class WorkerError(Exception):
    """The function raised, which is a defect; the message is the worker's traceback."""


@dataclass(frozen=True, slots=True)
class Raised:
    """Instead of a result: the exception of the function, as text, since not every exception can be pickled."""

    text: str


def attempt(function: Callable[[Any], Any], item: Any) -> Any:
    """Return the result, or the exception."""
    try:
        return function(item)
    except Exception:
        return Raised(traceback.format_exc())


def checked(outcome: Any) -> Any:
    """Return a result.

    Raises
    ------
    WorkerError
        When it is none.
    """
    if isinstance(outcome, Raised):
        raise WorkerError(outcome.text)
    return outcome
