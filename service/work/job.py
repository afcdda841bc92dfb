"""The work of one request: its times, its deadline and its answer."""

from __future__ import annotations

from dataclasses import dataclass, field

from association import Deadline
from linefix.documents.encoding import encode
from linefix.operations import Json, Stopwatch


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
