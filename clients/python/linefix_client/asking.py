"""Requests of both clients, and the rule for sending them again."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import quote

import httpx

from .problems import UnreachableError, problem_of

AGAIN = (429, 503)  # nothing was done, and the service says when to come again
LONGEST_WAIT = 30.0  # s, for one Retry-After
MAX_ANSWER_BYTES = 256 * 2**20  # eight times what the largest map may have by default
FIRST_WAIT = 0.5  # s, doubled with each try, where the service does not say


@dataclass(frozen=True)
class Form:
    """A body of named files and fields."""

    files: Sequence[tuple[str, bytes]]
    fields: Mapping[str, str | Sequence[str]]


@dataclass(frozen=True)
class Question:
    """One request, and what of its answer is wanted."""

    method: str
    path: str
    body: Any = None
    headers: dict[str, str] = field(default_factory=dict)
    params: dict[str, Any] = field(default_factory=dict)
    form: Form | None = None

    def on(self, client: httpx.Client | httpx.AsyncClient) -> httpx.Request:
        """Return the request as a client sends it."""
        return client.build_request(
            self.method,
            self.path,
            json=self.body,
            data=None if self.form is None else self.form.fields,
            files=None if self.form is None else [("file", file) for file in self.form.files],
            headers=self.headers,
            params={name: value for name, value in self.params.items() if value is not None},
        )


@dataclass(frozen=True)
class Settings:
    """Settings of a client.

    Attributes
    ----------
    url : str
    key : str or None
    timeout : float
        Seconds for one try.
    retries : int
        Number of times that a request is sent again after 429 or 503.
    """

    url: str
    key: str | None
    timeout: float
    retries: int

    def of_httpx(self) -> dict[str, Any]:
        """Return them as httpx takes them."""
        headers = {} if self.key is None else {"Authorization": f"Bearer {self.key}"}
        return {"base_url": self.url.rstrip("/"), "headers": headers, "timeout": self.timeout}


@dataclass
class Reading:
    """Takes an answer piece by piece, within bounds.

    Attributes
    ----------
    response : httpx.Response
        Whose body was not read yet.
    timeout : float
        Seconds for all of it.
    content : bytearray
        The bytes received so far.
    """

    response: httpx.Response
    timeout: float
    content: bytearray = field(default_factory=bytearray)
    begun: float = field(default_factory=time.monotonic)

    def take(self, piece: bytes) -> None:
        """Take one piece.

        Raises
        ------
        UnreachableError
            When there is more of it than a service sends, or it takes longer.
        """
        self.content += piece
        if len(self.content) > MAX_ANSWER_BYTES:
            raise UnreachableError(f"{self.response.url}: the answer is longer than {MAX_ANSWER_BYTES // 2**20} MB")
        if time.monotonic() - self.begun > self.timeout:
            raise UnreachableError(f"{self.response.url}: the answer has not ended after {self.timeout:g} s")

    def done(self) -> Answer:
        """Return the whole answer."""
        return Answer(
            self.response.status_code, self.response.reason_phrase, self.response.headers, bytes(self.content)
        )


@dataclass(frozen=True)
class Answer:
    """A whole answer."""

    status: int
    phrase: str
    headers: httpx.Headers
    content: bytes

    def json(self) -> Any:
        """Return the body; raises `ValueError` where it is no JSON, or nested too deep."""
        try:
            return json.loads(self.content)
        except RecursionError:
            raise ValueError("nested too deep") from None


def wait_before_next(answer: Answer, tries: int, retries: int) -> float | None:
    """Return how long to wait before the request is sent again, seconds; None where it is not."""
    if answer.status not in AGAIN or tries > retries:
        return None
    told = answer.headers.get("Retry-After", "")
    wait = float(told) if told.isascii() and told.isdigit() else FIRST_WAIT * 2.0 ** (tries - 1)
    return min(wait, LONGEST_WAIT)


def answer_of(answer: Answer) -> Any:
    """Return what was answered.

    Raises
    ------
    ProblemError
        When the request was refused.
    UnreachableError
        When what answers is no Linefix.
    """
    if not 200 <= answer.status < 300:
        raise problem_of(answer.status, answer.phrase, _json_of(answer))
    if not answer.content:
        return None
    told = _json_of(answer)
    if told is None:
        raise UnreachableError("what answers is no Linefix: its answer is no JSON; check the URL")
    return told


def _json_of(answer: Answer) -> Any:
    try:
        return answer.json()
    except ValueError:
        return None


def map_path(map_id: str) -> str:
    """Return the path of a stored map."""
    return f"/v1/maps/{quote(map_id, safe='')}"


def check_of(map_id: str, body: Any) -> Question:
    """Return the request for a check of a stored map; with a body also by scans taken there."""
    return Question("GET" if body is None else "POST", map_path(map_id) + ":check", body)


def update_of(map_id: str, body: Any) -> Question:
    """Return the request for an update of a stored map."""
    return Question("POST", map_path(map_id) + ":update", body)


def import_of(files: Sequence[tuple[str, bytes]], fields: Mapping[str, str | Sequence[str]] | None) -> Question:
    """Return the request for an import."""
    return Question("POST", "/v1/maps:import", form=Form(files, fields or {}))


def if_match(revision: int | None) -> dict[str, str]:
    """Return the header by which only one revision is changed; none where any may be."""
    return {} if revision is None else {"If-Match": f'"{revision}"'}
