"""The work of one request: its times, its deadline and its answer; an operation that takes long goes in turns."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from association import CancelledError, Deadline, MapIndex
from linefix.documents.encoding import encode
from linefix.documents.errors import DeadlinePassedError
from linefix.operations import Json, Steps, Stopwatch

from ..maps import CachedMap
from ..maps.lookup import FoundMaps

TURN_SECONDS = 0.1  # of the gate, before others have theirs
Operation = Callable[[MapIndex, FoundMaps], Steps]
"""Give the steps of an operation on a map, with its index."""


@dataclass(slots=True, kw_only=True)
class Job:
    """The work of one request.

    Attributes
    ----------
    request_id : str
    watch : Stopwatch
        Since the body had arrived.
    deadline : Deadline
    noted : dict
        Further fields of the request's line in the log.
    """

    request_id: str
    watch: Stopwatch = field(default_factory=Stopwatch)
    deadline: Deadline = field(default_factory=Deadline)
    noted: dict[str, object] = field(default_factory=dict)

    def note(self, **fields: object) -> None:
        """Add fields to the log's line of this request."""
        self.noted.update(fields)

    def encoded(self, answer: Json, **noted: object) -> bytes:
        """Return an answer as JSON, with the request's id and its times; `noted` are fields for the log.

        Raises
        ------
        NotFiniteError
            When it holds a number that is not finite.
        """
        self.note(**noted)
        return encode({**answer, "request_id": self.request_id, "timing_ms": self.watch.timing_ms()})


def take_turn(steps: Steps, deadline: Deadline) -> Json | None:
    """Take steps for `TURN_SECONDS`; return the answer, None while there are more.

    Raises
    ------
    CancelledError
        When the client has gone.
    """
    until = time.monotonic() + TURN_SECONDS
    while True:
        try:
            next(steps)
        except StopIteration as done:
            answer: Json = done.value
            return answer
        if deadline.cancelled:
            raise CancelledError
        if time.monotonic() >= until:
            return None


def begin(operation: Operation, ready: CachedMap, found: FoundMaps, job: Job) -> Steps:
    """Read a request, which is the first step; the others look at the deadline.

    Raises
    ------
    StoreError, ParserEndedError
        When the document of the map cannot be had.
    InputError, InvalidRequestError
        When the libraries reject a part of the request.
    DeadlinePassedError
        When the deadline has passed before.
    """
    assert isinstance(ready.maps, MapIndex)
    steps = operation(ready.maps, found)
    next(steps)
    job.watch.lap("decode")
    if job.deadline.passed and not job.deadline.cancelled:
        raise DeadlinePassedError
    return steps
