"""Analyses of maps: places where a robot would not find its pose."""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator
from dataclasses import dataclass, field

from association import CancelledError, Deadline
from linefix.answering import Json
from linefix.documents.analysis import AnalyzeRequest
from linefix.documents.inputs import analysis_of
from linefix.documents.parts import InlineMap
from linefix.documents.results import analysis_json
from map_quality import Analysis, PlaceVerdict

from ..maps.lookup import FoundMap, MapLookup
from .association import reference_to
from .job import Done, Job

TURN_SECONDS = 0.1  # of the gate, before others have theirs


@dataclass(slots=True)
class Tally:
    """The results so far; one per request, filled in steps of one slot of the gate.

    Attributes
    ----------
    analysis : Analysis
    reference : dict or None
        Id and revision of the map.
    todo : iterator of int
        Numbers of the poses that are left to try.
    found : dict of number to PlaceVerdict or None
        None where no robot can stand.
    looking : (int, generator) or None
        At which pose a turn ended, and what goes on there.
    """

    analysis: Analysis
    reference: Json | None
    todo: Iterator[int]
    found: dict[int, PlaceVerdict | None] = field(default_factory=dict)
    looking: tuple[int, Generator[None, None, PlaceVerdict | None]] | None = None

    @property
    def done(self) -> bool:
        """Return whether every pose was tried."""
        return len(self.found) == len(self.analysis.standing.order)


def begin_analysis(lookup: MapLookup, source: InlineMap | FoundMap, asked: AnalyzeRequest, job: Job) -> Tally:
    """Index a map and lay the grid over it.

    Raises
    ------
    StoreError
        When the map cannot be had.
    ParserEndedError
        When it is large and could not be read.
    AnalysisError, InputError
        When the requested places cannot be had, or the landmark is none.
    DeadlinePassedError
        When the deadline has passed before.
    """
    cached = lookup.indexed(source, oriented=None, deadline=job.deadline)
    analysis = analysis_of(cached.index, asked)
    job.begin_search()
    return Tally(analysis, reference_to(source), iter(analysis.standing.order.tolist()))


def take_looks(tally: Tally, deadline: Deadline) -> bool:
    """Try poses for `TURN_SECONDS`; return whether any are left.

    Raises
    ------
    CancelledError
        When the client has gone.
    """
    until = time.monotonic() + TURN_SECONDS
    while True:
        if tally.looking is None:
            number = next(tally.todo, None)
            if number is None:
                return False
            tally.looking = number, tally.analysis.looking(number, deadline)
        number, steps = tally.looking
        ended, verdict = False, None
        try:
            next(steps)
        except StopIteration as done:
            ended, verdict = True, done.value
        if deadline.cancelled:
            raise CancelledError
        if deadline.passed:
            return False  # an unfinished result is no answer: the search was cut
        if ended:
            tally.looking = None
            tally.found[number] = verdict
        if time.monotonic() >= until:
            return True


def analysis_done(tally: Tally, asked: AnalyzeRequest, job: Job) -> Done:
    """Return the answer."""
    job.watch.lap("search")
    answer = analysis_json(tally.analysis, tally.found)
    sealed = {**answer, "map": tally.reference, "client_ref": asked.client_ref}
    return job.done(sealed, map=tally.reference, places=answer["summary"]["places"])
