"""Many questions on all cores: drawn, searched and recorded in processes, in an order that does not depend on them."""

from __future__ import annotations

import multiprocessing
import os
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

from simulation import CONDITIONS, FAMILIES

from .cases import FORMS, in_map, questions
from .outcomes import WorldOutcome, answer

IN_MAP, STRANGERS = 35, 125  # scans of each world and condition
REPORT_EVERY = 5.0  # s


@dataclass(frozen=True, slots=True)
class Chunk:
    """What one process does at a time: some numbers of one world and condition."""

    world: str
    condition: str
    numbers: range


@dataclass(frozen=True, slots=True)
class Choice:
    """What is drawn.

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


def run(choice: Choice, processes: int | None = None) -> list[WorldOutcome]:
    """Search all that was chosen, both forms of each scan; tell on standard error how far it is.

    Parameters
    ----------
    choice : Choice
    processes : int, optional
        As many as there are cores by default. The answers do not depend on it.
    """
    chunks, found = choice.chunks, []
    began = told = time.monotonic()
    for done, outcomes in enumerate(_results(chunks, processes or os.cpu_count() or 1), start=1):
        found += outcomes
        now = time.monotonic()
        if now - told > REPORT_EVERY or done == len(chunks):
            told = now
            left = (now - began) / done * (len(chunks) - done)
            print(f"worlds: {done} of {len(chunks)} chunks, {len(found)} answers, {left:.0f} s left", file=sys.stderr)
    return found


def _results(chunks: Sequence[Chunk], processes: int) -> Iterator[list[WorldOutcome]]:
    """Yield the outcomes of each chunk, in their order."""
    if processes == 1:
        _warm_up()
        yield from map(outcomes_of, chunks)
        return
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(processes, mp_context=context, initializer=_warm_up) as pool:
        yield from pool.map(outcomes_of, chunks)


def outcomes_of(chunk: Chunk) -> list[WorldOutcome]:
    """Search the scans of one chunk, each in every form."""
    drawn = questions([chunk.world], [chunk.condition], chunk.numbers)
    return [answer(question, form) for question in drawn for form in FORMS]


def _warm_up() -> None:
    """Compile what is compiled, so that no answer's time holds it."""
    outcomes_of(Chunk("offices", "window", range(1)))
    outcomes_of(Chunk("offices", "clutter_33", range(1)))
