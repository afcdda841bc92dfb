"""Scans of a log to poses: by the search in this process, or by a server."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

import linefix
from registration import InputError, RigidTransform

from .asking import server_at
from .compiling import compile_first
from .contract import Json
from .errors import RefusedError
from .logs import sent
from .options import UsableOptions
from .several import documents_of

if TYPE_CHECKING:
    from formats import LoggedScan

    from .server import Server


@dataclass(frozen=True, slots=True)
class Found:
    """The part of an answer that a replay needs, for the robot, or the sensor where its mount is not known.

    Attributes
    ----------
    status : str
    usable : bool
    probability : float or None
    pose : RigidTransform or None
    covariance : (3, 3) rows or None
    reasons : list of dict
        ``code`` and ``message``.
    warnings : list of str
        Codes.
    timing_ms : dict
    map_id : str or None
        Of several maps the one that the pose is on.
    """

    status: str
    usable: bool
    probability: float | None
    pose: RigidTransform | None
    covariance: list[list[float]] | None
    reasons: list[Json]
    warnings: list[str]
    timing_ms: Json
    map_id: str | None = None


class Locator(Protocol):
    """Finds the scans of a log in one map, or on several; then a prior is on the map `prior_map`."""

    def locate(self, one: LoggedScan, prior: linefix.SoftPrior | None, prior_map: str | None = None) -> Found:
        """Return where a scan was taken; raises `RefusedError` where it is not taken."""
        ...


@contextmanager
def locating(target: Json, usable: UsableOptions, server: str | None) -> Iterator[Locator]:
    """Give a locator for the map, or the maps, of a request: this process, or the server at a URL.

    Raises
    ------
    CommandError
        When the map is not taken, or no server answers.
    """
    if server is not None:
        with closing(server_at(server)) as remote:
            yield Remote(remote, target, usable)
        return
    from .stored import require_size, settings_here

    seconds = 1e-3 * settings_here().max_deadline_ms
    documents = documents_of(target, None)
    for document in documents.values():
        require_size(document)
    compile_first()
    try:
        several = "maps" in target
        index = linefix.index_maps(documents) if several else linefix.index_map(next(iter(documents.values())))
    except InputError as error:
        raise RefusedError(str(error)) from None
    yield Local(index, linefix.AssociationOptions(max_alternatives=0, parts=(), **asdict(usable)), seconds)


@dataclass(frozen=True, slots=True)
class Local:
    """The search of this process.

    Attributes
    ----------
    index : MapIndex or MapSet
    options : AssociationOptions
    seconds : float
        That a search may take.
    """

    index: linefix.MapIndex | linefix.MapSet
    options: linefix.AssociationOptions
    seconds: float

    def locate(self, one: LoggedScan, prior: linefix.SoftPrior | None, prior_map: str | None = None) -> Found:
        """Return where a scan was taken."""
        begun = time.perf_counter()
        try:
            scan = linefix.scan_of(one)
            read = time.perf_counter()
            deadline = linefix.Deadline(time.monotonic() + self.seconds)
            answer = linefix.locate(
                self.index, scan, prior=prior, prior_map=prior_map, options=self.options, deadline=deadline
            )
        except InputError as error:
            raise RefusedError(str(error)) from None
        ended = time.perf_counter()
        return Found(
            str(answer.status),
            answer.usable,
            answer.probability,
            answer.pose,
            None if answer.covariance is None else answer.covariance.tolist(),
            [{"code": reason.code, "message": reason.message} for reason in answer.reasons],
            [warning.code for warning in answer.warnings],
            {"decode": _ms(read - begun), "search": _ms(ended - read), "total": _ms(ended - begun)},
            answer.map_id,
        )


class Remote:
    """A server, over HTTP."""

    def __init__(self, service: Server, target: Json, usable: UsableOptions) -> None:
        self._service = service
        self._target = target
        self._options = {"include": [], "max_alternatives": 0, **asdict(usable)}

    def locate(self, one: LoggedScan, prior: linefix.SoftPrior | None, prior_map: str | None = None) -> Found:
        """Return where a scan was taken."""
        body: Json = {**self._target, "scan": sent(one), "options": self._options}
        if prior is not None:
            body["prior"] = {**_pose(prior.pose), "covariance": np.asarray(prior.covariance).tolist()}
            if prior_map is not None:
                body["prior"]["map_id"] = prior_map
        answer = self._service.ask("associate", body)
        pose = answer["pose"]
        return Found(
            answer["status"],
            answer["usable"],
            answer["probability"],
            None if pose is None else RigidTransform(pose["x"], pose["y"], pose["theta"]),
            answer["covariance"],
            answer["reasons"],
            [warning["code"] for warning in answer["warnings"]],
            answer["timing_ms"],
            answer["map"]["map_id"] if "maps" in self._target and answer["map"] else None,
        )


def _pose(pose: RigidTransform) -> Json:
    return {"x": pose.x, "y": pose.y, "theta": pose.theta}


def _ms(seconds: float) -> float:
    return round(1e3 * seconds, 3)
