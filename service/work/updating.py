"""Updates of maps, in steps of one slot of the gate: a scan, or the evidence of all, at a step."""

from __future__ import annotations

import time
from collections.abc import Generator
from dataclasses import dataclass

from association import CancelledError, Deadline
from linefix.answering import Json, applied
from linefix.documents.inputs import visit_scans
from linefix.documents.parts import MapDocument
from linefix.documents.results import update_json
from linefix.documents.updates import ApplyRequest, UpdateRequest
from map_quality import MapUpdate, updating

from ..maps.lookup import FoundMap, MapLookup
from .association import reference_to
from .job import Done, Job

TURN_SECONDS = 0.1  # of the gate, before others have theirs


@dataclass(slots=True)
class Progress:
    """An update in the making; one per request.

    Attributes
    ----------
    steps : generator
    old : MapDocument
    reference : dict or None
        Id and revision of the old map.
    update : MapUpdate or None
        Once it is done.
    """

    steps: Generator[None, None, MapUpdate]
    old: MapDocument
    reference: Json | None
    update: MapUpdate | None = None


def begin_update(lookup: MapLookup, source: FoundMap, asked: UpdateRequest, job: Job) -> Progress:
    """Index a map and read the scans.

    Raises
    ------
    StoreError
        When the map cannot be had.
    ParserEndedError
        When it is large and could not be read.
    InvalidRequestError
        When the libraries reject a scan.
    DeadlinePassedError
        When the deadline has passed before.
    """
    cached, old = lookup.indexed(source, oriented=None, deadline=job.deadline), lookup.document(source)
    scans = visit_scans(asked)
    job.begin_search()
    steps = updating(cached.index, scans, job.deadline, accept=asked.accept, refuse=asked.refuse)
    return Progress(steps, old, reference_to(source))


def take_steps(progress: Progress, deadline: Deadline) -> bool:
    """Go on for `TURN_SECONDS`; return whether there is more to do.

    Raises
    ------
    CancelledError
        When the client has gone.
    InvalidArgumentError
        When a change is refused that is not proposed.
    """
    until = time.monotonic() + TURN_SECONDS
    while time.monotonic() < until:
        try:
            next(progress.steps)
        except StopIteration as done:
            progress.update = done.value
            return False
        if deadline.cancelled:
            raise CancelledError
    return True


def update_done(progress: Progress, asked: UpdateRequest, job: Job) -> Done:
    """Return the answer of an update that is done."""
    assert progress.update is not None
    job.watch.lap("search")
    sealed = {"based_on": progress.reference, "client_ref": asked.client_ref}
    answer = update_json(progress.update, progress.old)
    return job.done({**answer, **sealed}, map=progress.reference, changes=len(progress.update.changes))


def answer_apply(asked: ApplyRequest, job: Job) -> Done:
    """Return a map with the changes that are accepted.

    Raises
    ------
    InputError
        When the map could not be put, or a change is not one of this map.
    """
    accepted = sum(one.accepted for one in asked.changes)
    return job.done({**applied(asked, job.watch), "client_ref": asked.client_ref}, changes=accepted)
