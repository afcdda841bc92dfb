"""Operations on a map that take long: analyses, checks, updates, in turns of one slot of the gate."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from association import CancelledError, Deadline
from linefix.documents.analysis import AnalyzeRequest
from linefix.documents.parts import InlineMap, is_oriented
from linefix.documents.requests import CheckRequest
from linefix.documents.updates import UpdateRequest
from linefix.operations import Json, Steps, analysis_steps, check_steps, update_steps

from ..maps.lookup import FoundMap, MapLookup
from .job import Job

TURN_SECONDS = 0.1  # of the gate, before others have theirs
Begin = Callable[[MapLookup, InlineMap | FoundMap, Deadline], Steps]
"""Index a map, and give the steps of an operation on it.

Raises
------
StoreError
    When the map cannot be had.
ParserEndedError
    When it is large and could not be read.
"""


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


def begin(operation: Begin, lookup: MapLookup, source: InlineMap | FoundMap, job: Job) -> Work:
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
    steps = operation(lookup, source, job.deadline)
    next(steps)
    job.begin_search()
    return Work(steps, job.deadline)


def analysis_of(asked: AnalyzeRequest) -> Begin:
    """Return the operation of an analysis."""

    def begin_analysis(lookup: MapLookup, source: InlineMap | FoundMap, deadline: Deadline) -> Steps:
        index = lookup.indexed(source, oriented=None, deadline=deadline).index
        return analysis_steps(index, asked, deadline)

    return begin_analysis


def check_of(asked: CheckRequest | None) -> Begin:
    """Return the operation of a check, of the map with its directions, whatever they mean."""

    def begin_check(lookup: MapLookup, source: InlineMap | FoundMap, deadline: Deadline) -> Steps:
        own = source.record.oriented if isinstance(source, FoundMap) else source.oriented
        # Of its own: an index without directions, which a check may add to it, goes with the check, for the cache does
        # not count it.
        index = replace(lookup.indexed(source, oriented=True, deadline=deadline).index)
        return check_steps(index, asked, deadline, oriented=is_oriented(None, own))

    return begin_check


def update_of(asked: UpdateRequest) -> Begin:
    """Return the operation of an update."""

    def begin_update(lookup: MapLookup, source: InlineMap | FoundMap, deadline: Deadline) -> Steps:
        index = lookup.indexed(source, oriented=None, deadline=deadline).index
        old = lookup.document(source) if isinstance(source, FoundMap) else source
        return update_steps(index, old, asked, deadline)

    return begin_update
