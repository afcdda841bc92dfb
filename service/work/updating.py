"""Updates of maps, in steps of one slot of the gate: a scan, or the evidence of all, at a step."""

from __future__ import annotations

import time
from collections.abc import Generator
from dataclasses import dataclass
from typing import Any

import numpy as np

from association import CancelledError, Deadline
from linefix.answers import Json
from linefix.documents.errors import Fault, InvalidRequestError
from linefix.documents.parts import MapDocument
from linefix.documents.updates import ApplyRequest, ProposedChange, SharpenedWalls, UpdateRequest
from linefix.map_answers import update_json
from map_quality import NOT_SHARPENED, MapUpdate, Replacement, Sharpened, VisitScan, apply_changes, updating
from registration import InputError, Segments

from ..maps.lookup import FoundMap, MapLookup, outline_of
from .association import reference_to
from .inputs import naming_scan, scanned_of, transform_of
from .job import Done, Job

TURN_SECONDS = 0.1  # of the gate, before others have theirs


@dataclass(slots=True)
class Progress:
    """An update in the making; one per request.

    Attributes
    ----------
    steps : generator
    document : dict
        Fields of the old map that the new one has.
    reference : dict or None
        Id and revision of the old map.
    update : MapUpdate or None
        Once it is done.
    """

    steps: Generator[None, None, MapUpdate]
    document: Json
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
    scans = [
        _scan_of(asked, number, place) for number, one in enumerate(asked.visits) for place in range(len(one.scans))
    ]
    job.begin_search()
    steps = updating(cached.index, scans, job.deadline, accept=asked.accept, refuse=asked.refuse)
    return Progress(steps, _kept_fields(old), reference_to(source))


def _kept_fields(old: MapDocument) -> Json:
    """Return the fields of a map that no update changes."""
    points: dict[str, Any] = {"points": old.points.tolist(), "points_sigma": old.points_sigma}
    kept = {"oriented": old.oriented, "frame_id": old.frame_id, "meta": old.meta}
    return {**kept, **(points if len(old.points) else {})}


def _scan_of(asked: UpdateRequest, visit: int, number: int) -> VisitScan:
    """Return a scan of a visit; an error names its place in the request."""
    one = asked.visits[visit].scans[number]
    with naming_scan(f"/visits/{visit}/scans/{number}"):
        pose = None if one.pose is None else transform_of(one.pose)
        odometry = None if one.odometry is None else transform_of(one.odometry)
        return VisitScan(scanned_of(one).scan, asked.visits[visit].visit, pose, one.covariance, odometry)


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
    answer = update_json(progress.update, progress.document)
    return job.done({**answer, **sealed}, map=progress.reference, changes=len(progress.update.changes))


def answer_apply(asked: ApplyRequest, job: Job) -> Done:
    """Return a map with the changes that are accepted.

    Raises
    ------
    InputError
        When the map could not be put, or a change is not one of this map.
    """
    outline_of(asked.map)
    old, known = asked.map, Segments.from_array(asked.map.segments, argument="map.segments")
    accepted = {number: one for number, one in enumerate(asked.changes) if one.accepted}
    changes = [_replacement_of(one, number) for number, one in accepted.items()]
    job.watch.lap("decode")
    try:
        new, sigma = apply_changes(known, old.sigma, changes, _sharpened_of(asked.sharpened))
    except InputError as error:
        if error.index is None:
            raise
        raise InvalidRequestError([Fault(f"/changes/{list(accepted)[error.index]}", error.message)]) from error
    job.watch.lap("search")
    document = {"segments": new.endpoints.tolist(), "sigma": sigma, **_kept_fields(old)}
    return job.done({"map": document, "client_ref": asked.client_ref}, changes=len(changes))


def _replacement_of(one: ProposedChange, number: int) -> Replacement:
    new = Segments.from_array([each.segment for each in one.new], argument=f"changes.{number}.new")
    return Replacement(one.code, tuple(one.segments), new.endpoints, np.array([each.sigma for each in one.new]))


def _sharpened_of(asked: SharpenedWalls | None) -> Sharpened:
    if asked is None:
        return NOT_SHARPENED
    ends = Segments.from_array(asked.ends, argument="sharpened.ends").endpoints
    return Sharpened(np.array(asked.segments, dtype=np.intp), ends, np.array(asked.sigma))
