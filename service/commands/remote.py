"""Answers of a server, over HTTP.

The standard library does: a few requests one after another need no pool, no HTTP/2 and no further packages.
"""

from __future__ import annotations

import http.client
import re
import socket
import urllib.error
import urllib.parse
import urllib.request
from email.message import Message
from typing import IO

import orjson

from .errors import NoServerError, WrongUseError, error_of
from .service import KEY, Json, Progress, Question

SECONDS = 120.0  # to wait for an answer: more than the longest deadline that a service has by default
_HEADER = re.compile(r"[!-~]+")


class RemoteService:
    """A server.

    Parameters
    ----------
    url : str
        Such as ``http://127.0.0.1:8000``.
    key : str or None

    Raises
    ------
    WrongUseError
        When the URL is none, or no header can hold the key.
    """

    def __init__(self, url: str, key: str | None) -> None:
        try:
            parts = urllib.parse.urlsplit(url)
            named = parts.scheme in ("http", "https") and parts.hostname is not None and parts.port != 0
        except ValueError:
            named = False
        if not named or not _HEADER.fullmatch(url):
            raise WrongUseError("--server: expected a URL such as http://127.0.0.1:8000")
        if key is not None and not _HEADER.fullmatch(key):
            raise WrongUseError(f"{KEY} in the environment holds a space, or a letter that no header can")
        self._url = url.rstrip("/")
        self._headers = {} if key is None else {"Authorization": f"Bearer {key}"}
        self._opener = urllib.request.build_opener(_NoRedirects)

    def ask(self, question: Question, body: Json) -> Json:
        """Return the answer of ``POST /v1/<question>``."""
        return self._json(self._send("POST", f"/v1/{question}", orjson.dumps(body)))

    def analyze(self, body: Json, progress: Progress) -> Json:
        """Return the answer of ``POST /v1/analyze``; nothing is known of its progress."""
        return self._json(self._send("POST", "/v1/analyze", orjson.dumps(body)))

    def _json(self, content: bytes) -> Json:
        try:
            answer = orjson.loads(content)
        except orjson.JSONDecodeError:
            answer = None
        if not isinstance(answer, dict):
            raise NoServerError(f"what answers at {self._url} is no Linefix; check the URL")
        return answer

    def _send(self, method: str, path: str, body: bytes | None = None) -> bytes:
        headers = dict(self._headers)
        if body is not None:
            headers["Content-Type"] = "application/json"
        request = urllib.request.Request(self._url + path, body, headers, method=method)
        try:
            with self._opener.open(request, timeout=SECONDS) as response:
                content: bytes = response.read()
                return content
        except urllib.error.HTTPError as error:
            with error:
                raise self._refusal(error.code, error.read()) from None
        except (OSError, http.client.HTTPException) as error:
            reason = error.reason if isinstance(error, urllib.error.URLError) else error
            said = reason.strerror if isinstance(reason, OSError) and reason.strerror else reason
            if isinstance(reason, socket.gaierror):
                said = "no such host"
            raise NoServerError(
                f"no server answers at {self._url}: {said}; start one with linefix serve, or leave --server out"
            ) from None

    def _refusal(self, status: int, content: bytes) -> Exception:
        problem = self._json(content)
        if status in (401, 403):
            return NoServerError(f"{self._url} asks for a key: set {KEY} in the environment to one that it knows")
        faults = problem.get("errors") or []
        return error_of(status, f"{self._url}: {problem.get('detail')}", faults)


class _NoRedirects(urllib.request.HTTPRedirectHandler):
    """Follows nowhere: the key would go along to whatever host is named."""

    def redirect_request(
        self, req: urllib.request.Request, fp: IO[bytes], code: int, msg: str, headers: Message, newurl: str
    ) -> None:
        return None
