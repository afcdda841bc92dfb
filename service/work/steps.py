"""Operations on a map that take long: analyses, checks, updates, in turns of one slot of the gate."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from association import CancelledError, Deadline, MapIndex
from linefix.operations import Json, Steps

from ..maps.lookup import FoundMaps, MapLookup
from .job import Job

TURN_SECONDS = 0.1  # of the gate, before others have theirs
Operation = Callable[[MapIndex, FoundMaps], Steps]
"""Give the steps of an operation on a map, with its index."""


@dataclass(slots=True)
class Work:
    """An operation in the making, one per request; its answer is there once all steps are taken."""

    steps: Steps
    deadline: Deadline
    answer: Json | None = None

    def take_turn(self) -> bool:
        """Take steps for `TURN_SECONDS`; return whether there are more. Raises `CancelledError` for a client gone."""
        until = time.monotonic() + TURN_SECONDS
        while True:
            try:
                next(self.steps)
            except StopIteration as done:
                self.answer = done.value
                return False
            if self.deadline.cancelled:
                raise CancelledError
            if time.monotonic() >= until:
                return True


def begin(operation: Operation, lookup: MapLookup, source: FoundMaps, job: Job, *, oriented: bool | None) -> Work:
    """Index a map and read the request, which is the first step; the others look at the deadline.

    Raises
    ------
    StoreError, ParserEndedError
        When the map cannot be had.
    InputError, InvalidRequestError
        When the libraries reject a part of the request.
    DeadlinePassedError
        When the deadline has passed before.
    """
    index = lookup.indexed(source, oriented=oriented, deadline=job.deadline).maps
    assert isinstance(index, MapIndex)
    steps = operation(index, source)
    next(steps)
    job.begin_search()
    return Work(steps, job.deadline)
