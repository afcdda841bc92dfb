"""Many questions on an engine: drawn, searched and recorded, in an order that does not depend on who did it."""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass
from functools import cache

from batch import Engine, Lost, Processes

from ..buildings import FAMILIES
from ..conditions import CONDITIONS
from .outcomes import WorldOutcome, answer
from .questions import FORMS, in_map, questions

IN_MAP, STRANGERS = 35, 125  # scans of each world and condition
REPORT_EVERY = 5.0  # s


@dataclass(frozen=True, slots=True)
class Chunk:
    """The work of one process at a time: some numbers of one world and condition."""

    world: str
    condition: str
    numbers: range


@dataclass(frozen=True, slots=True)
class Choice:
    """The cases to draw.

    Attributes
    ----------
    worlds, conditions : tuple of str
    quick : float
        Draw one in so many; below 1 more than usual.
    first : int
        The number of the first case of each world and condition; another one draws other cases.
    """

    worlds: tuple[str, ...] = tuple(FAMILIES)
    conditions: tuple[str, ...] = tuple(CONDITIONS)
    quick: float = 1.0
    first: int = 0

    @property
    def chunks(self) -> list[Chunk]:
        """All of it, in order."""
        found = []
        for condition in self.conditions:
            count = max(1, round((IN_MAP if in_map(condition) else STRANGERS) / self.quick))
            numbers = range(self.first, self.first + count)
            found += [Chunk(world, condition, numbers) for world in self.worlds]
        return found


def run(choice: Choice, engine: Engine | None = None) -> list[WorldOutcome]:
    """Search all that was chosen, both forms of each scan; tell on standard error how far it is.

    Parameters
    ----------
    choice : Choice
    engine : Engine, optional
        By default as many processes as there are cores. The answers do not depend on it.

    Raises
    ------
    RuntimeError
        When a chunk ended every worker that had it.
    """
    chunks, found = choice.chunks, {}
    began = told = time.monotonic()
    for chunk, outcomes in (engine or Processes(os.cpu_count() or 1)).run(outcomes_of, chunks):
        if isinstance(outcomes, Lost):
            raise RuntimeError(f"lost: {chunk}")
        found[chunk] = outcomes
        now = time.monotonic()
        if now - told > REPORT_EVERY or len(found) == len(chunks):
            told = now
            left = (now - began) / len(found) * (len(chunks) - len(found))
            print(f"worlds: {len(found)} of {len(chunks)} chunks, {left:.0f} s left", file=sys.stderr)
    return [outcome for chunk in chunks for outcome in found[chunk]]


def outcomes_of(chunk: Chunk) -> list[WorldOutcome]:
    """Search the scans of one chunk, each in every form."""
    _warm_up()
    return _searched(chunk)


def _searched(chunk: Chunk) -> list[WorldOutcome]:
    drawn = questions([chunk.world], [chunk.condition], chunk.numbers)
    return [answer(question, form) for question in drawn for form in FORMS]


@cache
def _warm_up() -> None:
    """Compile what is compiled, so that no answer's time holds it; once in a process."""
    _searched(Chunk("offices", "window", range(1)))
    _searched(Chunk("offices", "clutter_33", range(1)))
