"""A piece of work: its request, its begin, its deadline and its result."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from threading import Event
from typing import Any

from association import Deadline
from linefix.documents.encoding import encode

from ..admission.errors import DeadlinePassedError


class Stopwatch:
    """Milliseconds since the request's body had arrived, in parts."""

    def __init__(self) -> None:
        self._begun = time.monotonic()
        self._last = self._begun
        self._parts: dict[str, float] = {}

    def lap(self, name: str) -> None:
        """Note the milliseconds since the last lap under a name."""
        now = time.monotonic()
        self._parts[name] = round(1e3 * (now - self._last), 3)
        self._last = now

    def timing_ms(self) -> dict[str, float]:
        """Return the parts and the total so far."""
        return {**self._parts, "total": round(1e3 * (time.monotonic() - self._begun), 3)}

    def deadline(self, asked_ms: float | None, most_ms: float) -> Deadline:
        """Return when to end: so many milliseconds after the body had arrived, waiting for a slot included."""
        allowed = most_ms if asked_ms is None else min(asked_ms, most_ms)
        return Deadline(at=self._begun + allowed / 1e3)


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
    searching : Event
        Set once what goes on looks at the deadline.
    """

    request_id: str
    watch: Stopwatch
    deadline: Deadline
    searching: Event = field(default_factory=Event)

    def begin_search(self) -> None:
        """Note that the request is decoded, and that what follows looks at the deadline.

        Raises
        ------
        DeadlinePassedError
            When the deadline has passed before.
        """
        self.watch.lap("decode")
        if self.deadline.passed and not self.deadline.cancelled:
            raise DeadlinePassedError
        self.searching.set()

    def done(self, answer: dict[str, Any], **noted: object) -> Done:
        """Return an answer as JSON, with the request's id and its times.

        Raises
        ------
        NotFiniteError
            When it holds a number that is not finite.
        """
        sealed = {**answer, "request_id": self.request_id, "timing_ms": self.watch.timing_ms()}
        return Done(encode(sealed), noted)
