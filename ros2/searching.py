"""Scans to the pose of the robot, searched in a thread of their own, so that the main loop goes on meanwhile."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace

import numpy as np

import linefix
from formats.logs.tracks import Known
from registration import IDENTITY, InputError

from .agreement import Observation
from .frames import planar
from .looking import Look
from .maps import Maps
from .messages import NS, Time
from .options import NodeOptions
from .tuning import INCONCLUSIVE_NATS, RIVAL_NATS, SEARCH_SECONDS

OPTIONS = linefix.AssociationOptions(max_alternatives=10)  # each of them may be where the robot is


def observation_of(answer: linefix.AssociationResult, known: Known | None, stamp: int) -> Observation:
    """Return an answer for the agreement, with odom_from_base at its stamp (nanoseconds)."""
    best = 0.0 if answer.diagnostics is None else answer.diagnostics.score
    covariance = np.zeros((3, 3)) if answer.covariance is None else answer.covariance
    odometry = () if known is None else (planar(known.matrix), known.part, known.unknown_ns / NS)
    return replace(
        Observation(stamp, answer.pose or IDENTITY, covariance, answer.usable, *odometry),
        others=answer.alternatives,
        conclusive=_conclusive(answer),
        rival=any(one.score > best - RIVAL_NATS for one in answer.alternatives),
        map_id=answer.map_id,
    )


def _conclusive(answer: linefix.AssociationResult) -> bool:
    """Return whether each pose that explains the scan about as well is listed."""
    if answer.status not in (linefix.Status.OK, linefix.Status.AMBIGUOUS) or answer.diagnostics is None:
        return False
    unlisted = (1.0 - answer.search.complete_above) * answer.diagnostics.score
    listed = len(answer.alternatives) < OPTIONS.max_alternatives
    return listed and answer.search.complete and unlisted >= INCONCLUSIVE_NATS


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """The result of a search.

    Attributes
    ----------
    stamp : Time
        Of the scan, of several the newest.
    answer : AssociationResult or None
        Its poses are map_from_base; None where the scan cannot be searched.
    problem : str
        Why it cannot be searched.
    seconds : float
        That the search took.
    maps : Maps
        Those that were searched.
    """

    stamp: Time
    answer: linefix.AssociationResult | None
    problem: str
    seconds: float
    maps: Maps


class Searcher:
    """Searches one scan at a time.

    Parameters
    ----------
    options : NodeOptions
    found : callable
        Called in the thread of the searches when a result can be taken.
    """

    def __init__(self, options: NodeOptions, found: Callable[[], None]) -> None:
        self._options = replace(OPTIONS, on_map=options.on_map, usable_from=options.usable_from)
        self._found = found
        self._deadline = linefix.Deadline()
        self._pool = ThreadPoolExecutor(1, "searches")
        self._search: Future[Found] | None = None

    @property
    def busy(self) -> bool:
        """Return whether a result is still to be taken."""
        return self._search is not None

    def submit(self, maps: Maps, looks: Sequence[Look]) -> None:
        """Search a scan; only while not `busy`."""
        self._deadline = linefix.Deadline(time.monotonic() + SEARCH_SECONDS)
        self._search = self._pool.submit(self._searched, maps, looks)
        self._search.add_done_callback(lambda _: self._found())

    def result(self) -> Found | None:
        """Return the result of the search, None where there is none yet."""
        if self._search is None or not self._search.done():
            return None
        found, self._search = self._search.result(), None
        return found

    def end(self, seconds: float) -> bool:
        """Cancel the search, and return whether it has ended within a time."""
        self._deadline.cancel()
        self._pool.shutdown(wait=False)
        return self._search is None or not wait([self._search], seconds).not_done

    def _searched(self, maps: Maps, looks: Sequence[Look]) -> Found:
        begun, answer, problem = time.monotonic(), None, ""
        try:
            together = linefix.assemble([look.view for look in looks])  # at the time of the first beam of the first
            answer = linefix.locate(maps.index, together, options=self._options, deadline=self._deadline)
        except InputError as error:
            problem = f"the scan cannot be used: {error}"
        except Exception as error:  # the robot goes on without this scan
            problem = f"a defect of linefix; please report it: {type(error).__name__}: {error}"
        return Found(looks[0].stamp, answer, problem, time.monotonic() - begun, maps)
