"""An engine of Ray Data, for more than one machine."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from .engine import ATTEMPTS, Item, Lost, Result, attempt, checked


@dataclass(frozen=True, slots=True)
class OnRay:
    """Workers of a Ray cluster, each of one core.

    Ray chooses their place: the cluster that the caller is connected to, that of ``RAY_ADDRESS``, or a new one on this
    machine. Each machine needs Linefix, and the logs, the maps and the place of the output under the same paths.
    """

    def run(self, function: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[tuple[Item, Result | Lost]]:
        """Yield each item once with its result, as they are done; see `Engine.run`."""
        if not items:
            return
        import ray.data

        # Items that are lost for good stay out of the results; `left` shows them.
        ray.data.DataContext.get_current().max_errored_blocks = -1
        rows = [{"number": number, "item": pickle.dumps(item)} for number, item in enumerate(items)]
        # An item each: a lost worker costs one, and no more of them than there are cores are held anywhere.
        asked = ray.data.from_items(rows, override_num_blocks=len(rows))
        done = asked.map(_Call(function), num_cpus=1, max_retries=ATTEMPTS)
        left = set(range(len(items)))
        for row in done.iter_rows():
            outcome = checked(pickle.loads(row["outcome"]))
            left.remove(row["number"])
            yield items[row["number"]], outcome
        for number in sorted(left):
            yield items[number], Lost()


@dataclass(frozen=True, slots=True)
class _Call:
    """One row of a data set to another."""

    function: Callable[[Any], Any]

    def __call__(self, row: dict[str, Any]) -> dict[str, Any]:
        outcome = attempt(self.function, pickle.loads(row["item"]))
        return {"number": row["number"], "outcome": pickle.dumps(outcome)}
