"""Scans to the pose of the robot, searched in a thread of their own, so that the main loop goes on meanwhile."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import linefix
from formats.logs.tracks import Known
from registration import InputError, RigidTransform

from .agreement import Observation, Place
from .looking import Look
from .messages import Time
from .options import NodeOptions
from .transforms import NS, planar
from .tuning import INCONCLUSIVE_NATS, SEARCH_SECONDS

OPTIONS = linefix.AssociationOptions(max_alternatives=10)  # each of them may be where the robot is


@dataclass(frozen=True, slots=True, eq=False)
class Located:
    """The result of a scan.

    Attributes
    ----------
    stamp : Time
        Of the scan, of several the newest.
    answer : AssociationResult
        Its poses are map_from_base.
    """

    stamp: Time
    answer: linefix.AssociationResult

    @property
    def pose(self) -> RigidTransform | None:
        """map_from_base."""
        return self.answer.pose

    @property
    def covariance(self) -> NDArray[np.float64] | None:
        """Of the pose, (3, 3): additive (x, y, theta) in the map frame."""
        return self.answer.covariance

    def observation(self, known: Known | None, stamp: int) -> Observation:
        """Return the result for the agreement, with odom_from_base at its stamp (nanoseconds)."""
        odometry = () if known is None else (planar(known.matrix)[0], known.part, known.unknown_ns / NS)
        answer = self.answer
        others = tuple(Place(one.pose, one.map_id) for one in answer.alternatives)
        return replace(
            Observation(stamp, answer.pose, answer.covariance, answer.usable, *odometry),
            others=others,
            conclusive=self._conclusive,
            map_id=answer.map_id,
        )

    @property
    def _conclusive(self) -> bool:
        """Return whether each pose that explains the scan about as well is listed."""
        answer = self.answer
        if answer.status not in (linefix.Status.OK, linefix.Status.AMBIGUOUS) or answer.diagnostics is None:
            return False
        unlisted = (1.0 - answer.search.complete_above) * answer.diagnostics.score
        listed = len(answer.alternatives) < OPTIONS.max_alternatives
        return listed and answer.search.complete and unlisted >= INCONCLUSIVE_NATS


def search_options(options: NodeOptions) -> linefix.AssociationOptions:
    """Return how the node searches each scan."""
    return replace(OPTIONS, on_map=options.on_map, usable_from=options.usable_from)


def locate(
    index: linefix.MapIndex | linefix.MapSet,
    looks: Sequence[Look],
    options: linefix.AssociationOptions = OPTIONS,
    deadline: linefix.Deadline | None = None,
) -> Located:
    """Find where the robot is by one scan, or several together, at the time of the first beam of the first."""
    together = linefix.assemble([look.view for look in looks])
    return Located(looks[0].stamp, linefix.locate(index, together, options=options, deadline=deadline))


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """The result of a search.

    Attributes
    ----------
    stamp : Time
        Of the newest scan.
    located : Located or None
        None where the scan cannot be searched.
    problem : str
        Why it cannot be searched.
    seconds : float
        That the search took.
    generation : int
        Of the map that was searched, as it was given.
    """

    stamp: Time
    located: Located | None
    problem: str
    seconds: float
    generation: int


@dataclass(frozen=True, slots=True, eq=False)
class _Task:
    index: linefix.MapIndex | linefix.MapSet
    looks: Sequence[Look]
    generation: int


class Searcher:
    """Searches one scan at a time.

    Parameters
    ----------
    options : AssociationOptions
        Of each search.
    found : callable
        Called in the thread of the searches when a result can be taken.
    """

    def __init__(self, options: linefix.AssociationOptions, found: Callable[[], None]) -> None:
        self._options = options
        self._tasks: queue.SimpleQueue[_Task | None] = queue.SimpleQueue()
        self._results: queue.SimpleQueue[Found] = queue.SimpleQueue()
        self._deadline = linefix.Deadline()
        self._found = found
        self.busy = False
        self._thread = threading.Thread(target=self._run, name="searches", daemon=True)
        self._thread.start()

    def submit(self, index: linefix.MapIndex | linefix.MapSet, looks: Sequence[Look], generation: int) -> None:
        """Search a scan; only while not `busy`."""
        self.busy = True
        self._tasks.put(_Task(index, looks, generation))

    def result(self) -> Found | None:
        """Return the result of the search, None where there is none yet."""
        try:
            found = self._results.get_nowait()
        except queue.Empty:
            return None
        self.busy = False
        return found

    def end(self, seconds: float) -> bool:
        """Cancel the search, and return whether its thread has ended within a time."""
        self._deadline.cancel()
        self._tasks.put(None)
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while (task := self._tasks.get()) is not None:
            self._results.put(self._search(task))
            self._found()

    def _search(self, task: _Task) -> Found:
        stamp, begun = task.looks[0].stamp, time.monotonic()
        located, problem = None, ""
        try:
            located = locate(task.index, task.looks, self._options, self._deadline.within(begun + SEARCH_SECONDS))
        except InputError as error:
            problem = f"the scan cannot be used: {error}"
        except Exception as error:  # the robot goes on without this scan
            problem = f"a defect of linefix; please report it: {type(error).__name__}: {error}"
        return Found(stamp, located, problem, time.monotonic() - begun, task.generation)
