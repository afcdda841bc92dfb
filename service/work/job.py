"""A piece of work: its request, its begin, its deadline and its result; one that takes long goes in turns."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from association import CancelledError, Deadline, MapIndex
from linefix.documents.encoding import encode
from linefix.documents.errors import DeadlinePassedError
from linefix.operations import Json, Steps, Stopwatch

from ..maps.lookup import FoundMaps, MapLookup

TURN_SECONDS = 0.1  # of the gate, before others have theirs
Operation = Callable[[MapIndex, FoundMaps], Steps]
"""Give the steps of an operation on a map, with its index."""


@dataclass(frozen=True, slots=True)
class Done:
    """The result of a piece of work.

    Attributes
    ----------
    body : bytes
        The answer as JSON.
    noted : dict
        Fields for the log.
    """

    body: bytes
    noted: dict[str, object] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Job:
    """A piece of work.

    Attributes
    ----------
    request_id : str
    watch : Stopwatch
        Since the body had arrived.
    deadline : Deadline
    """

    request_id: str
    watch: Stopwatch
    deadline: Deadline

    def done(self, answer: dict[str, Any], **noted: object) -> Done:
        """Return an answer as JSON, with the request's id and its times.

        Raises
        ------
        NotFiniteError
            When it holds a number that is not finite.
        """
        sealed = {**answer, "request_id": self.request_id, "timing_ms": self.watch.timing_ms()}
        return Done(encode(sealed), noted)


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
    job.watch.lap("decode")
    if job.deadline.passed and not job.deadline.cancelled:
        raise DeadlinePassedError
    return Work(steps, job.deadline)
