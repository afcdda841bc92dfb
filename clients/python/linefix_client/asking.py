"""What both clients send, and when it is sent again."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any
from urllib.parse import quote

import httpx

from .problems import problem_of

AGAIN = (429, 503)  # nothing was done, and the service says when to come again
LONGEST_WAIT = 30.0  # s, for one Retry-After
FIRST_WAIT = 0.5  # s, doubled with each try, where the service does not say


@dataclass(frozen=True)
class Question:
    """One request, and what of its answer is wanted."""

    method: str
    path: str
    body: Any = None
    headers: dict[str, str] = field(default_factory=dict)
    params: dict[str, Any] = field(default_factory=dict)

    def on(self, client: httpx.Client | httpx.AsyncClient) -> httpx.Request:
        """Return the request as a client sends it."""
        return client.build_request(
            self.method,
            self.path,
            json=self.body,
            headers=self.headers,
            params={name: value for name, value in self.params.items() if value is not None},
        )


@dataclass(frozen=True)
class Settings:
    """How a client speaks to a service.

    Attributes
    ----------
    url : str
    key : str or None
    timeout : float
        Seconds for one try.
    retries : int
        How often a request is sent again after 429 or 503.
    """

    url: str
    key: str | None
    timeout: float
    retries: int

    def of_httpx(self) -> dict[str, Any]:
        """Return them as httpx takes them."""
        headers = {} if self.key is None else {"Authorization": f"Bearer {self.key}"}
        return {"base_url": self.url.rstrip("/"), "headers": headers, "timeout": self.timeout}


def wait_before_next(response: httpx.Response, tries: int, retries: int) -> float | None:
    """Return how long to wait before the request is sent again, seconds; None where it is not."""
    if response.status_code not in AGAIN or tries > retries:
        return None
    told = response.headers.get("Retry-After", "")
    wait = float(told) if told.isdigit() else FIRST_WAIT * 2.0 ** (tries - 1)
    return min(wait, LONGEST_WAIT)


def answer_of(response: httpx.Response) -> Any:
    """Return what was answered.

    Raises
    ------
    ProblemError
        When the request was refused.
    """
    if response.is_success:
        return response.json() if response.content else None
    raise problem_of(response)


def map_path(map_id: str) -> str:
    """Return the path of a stored map."""
    return f"/v1/maps/{quote(map_id, safe='')}"


def if_match(revision: int | None) -> dict[str, str]:
    """Return the header by which only one revision is changed; none where any may be."""
    return {} if revision is None else {"If-Match": f'"{revision}"'}
