"""A piece of work: its request, its begin, its deadline and its result."""

from __future__ import annotations

from dataclasses import dataclass, field
from threading import Event
from typing import Any

from association import Deadline
from linefix.documents.encoding import encode
from linefix.operations import Stopwatch

from ..errors import DeadlinePassedError


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
