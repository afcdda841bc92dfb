"""Answers of a server, over HTTP.

The standard library does: a few requests one after another need no pool, no HTTP/2 and no further packages.
"""

from __future__ import annotations

import http.client
import re
import secrets
import socket
import time
import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Iterator, Sequence
from email.message import Message
from pathlib import Path
from typing import IO

import orjson
from pydantic import BaseModel, ValidationError

from service.importing.fields import Fields
from service.schemas.analysis import AnalyzeAnswer
from service.schemas.checks import CheckAnswer
from service.schemas.imports import ImportAnswer
from service.schemas.replies import AssociateAnswer, MapList, MapSummaryAnswer, RegisterAnswer, Row4, VectorizeAnswer

from .errors import NOTHING, Asked, NoServerError, WrongUseError, error_of
from .service import KEY, Json, Progress, Question, id_of

SECONDS = 120.0  # to wait for an answer: more than the longest deadline that a service has by default
MAX_ANSWER_BYTES = 256 * 2**20  # eight times what the largest map may have by default
MAX_PAGES = 100_000  # of a list of maps
CHUNK = 2**20  # bytes
ANSWERS: dict[Question, type[BaseModel]] = {
    "associate": AssociateAnswer,
    "register": RegisterAnswer,
    "vectorize": VectorizeAnswer,
}
_HEADER = re.compile(r"[!-~]+")


class _StoredMap(BaseModel):
    """The fields of a stored map that commands use."""

    segments: list[Row4]
    sigma: float | None = None
    oriented: bool | None = None


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
        asked = Asked(map_id=id_of(body.get("map")))
        return self._answer(ANSWERS[question], self._send("POST", f"/v1/{question}", orjson.dumps(body), asked))

    def import_map(self, files: Sequence[Path], fields: Fields) -> Json:
        """Return the answer of ``POST /v1/maps:import``."""
        boundary = secrets.token_hex(16)
        asked = Asked(files=tuple(file.name for file in files))
        content = _form(files, fields, boundary.encode())
        media_type = f"multipart/form-data; boundary={boundary}"
        return self._answer(ImportAnswer, self._send("POST", "/v1/maps:import", content, asked, media_type))

    def check(self, on: Json, samples: Json | None) -> Json:
        """Return the answer of ``/v1/maps/{map_id}:check``, which is for stored maps."""
        map_id = id_of(on)
        if map_id is None:
            raise WrongUseError("a server checks stored maps: linefix map put it first, or leave --server out")
        method, body = ("GET", None) if samples is None else ("POST", orjson.dumps(samples))
        return self._answer(CheckAnswer, self._send(method, f"/v1/maps/{map_id}:check", body, Asked(map_id)))

    def put(self, map_id: str, document: Json) -> Json:
        """Store a map."""
        return self._answer(MapSummaryAnswer, self._send("PUT", f"/v1/maps/{map_id}", orjson.dumps(document)))

    def get(self, map_id: str) -> Json:
        """Return a stored map."""
        return self._answer(_StoredMap, self._send("GET", f"/v1/maps/{map_id}", asked=Asked(map_id)))

    def maps(self) -> Iterator[Json]:
        """Give what is told of each stored map, page by page."""
        cursor = ""
        for _ in range(MAX_PAGES):
            page = self._answer(MapList, self._send("GET", f"/v1/maps?cursor={urllib.parse.quote(cursor)}"))
            yield from page["maps"]
            if page["next"] is None:
                return
            cursor = str(page["next"])
        raise NoServerError(f"{self._url} lists more than {MAX_PAGES} pages of maps; check the URL")

    def remove(self, map_id: str) -> None:
        """Forget a stored map."""
        self._send("DELETE", f"/v1/maps/{map_id}", asked=Asked(map_id))

    def analyze(self, body: Json, progress: Progress) -> Json:
        """Return the answer of ``POST /v1/analyze``; nothing is known of its progress."""
        return self._answer(AnalyzeAnswer, self._send("POST", "/v1/analyze", orjson.dumps(body)))

    def _answer(self, model: type[BaseModel], content: bytes) -> Json:
        """Return an answer whose fields are those of its route; further fields may be of a later version.

        Raises
        ------
        NoServerError
            When a field is missing, or of another type.
        """
        answer = self._json(content)
        try:
            model.model_validate(answer)
        except ValidationError as error:
            wrong = [fault for fault in error.errors(include_url=False) if fault["type"] != "extra_forbidden"]
            if wrong:
                place = "/" + "/".join(map(str, wrong[0]["loc"]))
                raise NoServerError(
                    f"the answer of {self._url} is not that of this version of Linefix: {place}: {wrong[0]['msg']}; "
                    "check the URL and the version of the server"
                ) from None
        return answer

    def _json(self, content: bytes) -> Json:
        try:
            answer = orjson.loads(content)
        except orjson.JSONDecodeError:
            answer = None
        if not isinstance(answer, dict):
            raise NoServerError(f"what answers at {self._url} is no Linefix; check the URL")
        return answer

    def _send(
        self,
        method: str,
        path: str,
        body: bytes | None = None,
        asked: Asked = NOTHING,
        media_type: str = "application/json",
    ) -> bytes:
        headers = dict(self._headers)
        if body is not None:
            headers["Content-Type"] = media_type
        request = urllib.request.Request(self._url + path, body, headers, method=method)
        try:
            with self._opener.open(request, timeout=SECONDS) as response:
                return self._content(response)
        except urllib.error.HTTPError as error:
            with error:
                raise self._refusal(error.code, self._content(error), asked) from None
        except (OSError, http.client.HTTPException) as error:
            reason = error.reason if isinstance(error, urllib.error.URLError) else error
            said = reason.strerror if isinstance(reason, OSError) and reason.strerror else reason
            if isinstance(reason, socket.gaierror):
                said = "no such host"
            raise NoServerError(
                f"no server answers at {self._url}: {said}; start one with linefix serve, or leave --server out"
            ) from None

    def _content(self, response: IO[bytes]) -> bytes:
        """Return what was answered.

        Raises
        ------
        NoServerError
            When there is more of it than a service sends, or it takes longer.
        """
        content, until = bytearray(), time.monotonic() + SECONDS
        while chunk := response.read1(CHUNK):  # type: ignore[attr-defined]
            content += chunk
            if len(content) > MAX_ANSWER_BYTES:
                raise NoServerError(f"{self._url} answers with more than {MAX_ANSWER_BYTES // 2**20} MB; check the URL")
            if time.monotonic() > until:
                raise NoServerError(f"{self._url} has not ended its answer after {SECONDS:.0f} s; check the URL")
        return bytes(content)

    def _refusal(self, status: int, content: bytes, asked: Asked) -> Exception:
        problem = self._json(content)
        if status in (401, 403):
            return NoServerError(f"{self._url} asks for a key: set {KEY} in the environment to one that it knows")
        listed = problem.get("errors")
        faults = [
            fault
            for fault in (listed if isinstance(listed, list) else [])
            if isinstance(fault, dict) and isinstance(fault.get("pointer"), str) and "message" in fault
        ]
        return error_of(status, str(problem.get("code")), f"{self._url}: {problem.get('detail')}", faults, asked)


def _form(files: Sequence[Path], fields: Fields, boundary: bytes) -> bytes:
    """Return files and fields as multipart/form-data (RFC 7578)."""
    parts = [(f'name="{name}"', value.encode()) for name, values in fields.items() for value in values]
    parts += [(f'name="file"; filename="{_quoted(file.name)}"', file.read_bytes()) for file in files]
    whole = bytearray()
    for told, content in parts:
        whole += b"--%b\r\nContent-Disposition: form-data; %b\r\n\r\n%b\r\n" % (boundary, told.encode(), content)
    return bytes(whole + b"--%b--\r\n" % boundary)


def _quoted(name: str) -> str:
    return name.replace('"', "%22").replace("\r", "%0D").replace("\n", "%0A")


class _NoRedirects(urllib.request.HTTPRedirectHandler):
    """Follows nowhere: the key would go along to whatever host is named."""

    def redirect_request(
        self, req: urllib.request.Request, fp: IO[bytes], code: int, msg: str, headers: Message, newurl: str
    ) -> None:
        return None
