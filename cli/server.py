"""Answers of a server to requests of ``linefix-client``."""

from __future__ import annotations

import re
import urllib.parse
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from linefix_client import Client, LinefixError, ProblemError, schema
from pydantic import TypeAdapter, ValidationError

from .contract import KEY, Fields, Json, Question, id_of
from .errors import NOTHING, Asked, CommandError, NoServerError, WrongUseError, error_of

SECONDS = 120.0  # to wait for an answer: more than the longest deadline that a service has by default
MAX_PAGES = 100_000  # of a list of maps
_HEADER = re.compile(r"[!-~]+")


class Server:
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
            found = "one with a name or a password" if "@" in url else repr(url)
            raise WrongUseError(f"--server: expected a URL such as http://127.0.0.1:8000, found {found}")
        if key is not None and not _HEADER.fullmatch(key):
            raise WrongUseError(
                f"{KEY} in the environment: found a space or a character that a header "
                "cannot contain, expected a key of printable ASCII"
            )
        self._url = url.rstrip("/")
        self._client = Client(self._url, key, timeout=SECONDS)

    def close(self) -> None:
        """Close its connections."""
        self._client.close()

    def ask(self, question: Question, body: Any) -> Json:
        """Return the answer of ``POST /v1/<question>``."""
        asked = Asked(map_id=id_of(body.get("map")))
        if question == "associate":
            return self._answer(schema.AssociateAnswer, asked, self._client.associate, body)
        if question == "register":
            return self._answer(schema.RegisterAnswer, asked, self._client.register, body)
        return self._answer(schema.VectorizeAnswer, asked, self._client.vectorize, body)

    def import_map(self, files: Sequence[Path], fields: Fields) -> Json:
        """Return the answer of ``POST /v1/maps:import``."""
        asked = Asked(files=tuple(file.name for file in files))
        named = [(file.name, file.read_bytes()) for file in files]
        return self._answer(schema.ImportAnswer, asked, self._client.import_map, named, fields)

    def check(self, on: Json, samples: Json | None) -> Json:
        """Return the answer of ``/v1/maps/{map_id}:check``, which is for stored maps."""
        map_id = _stored(on)
        return self._answer(schema.CheckAnswer, Asked(map_id), self._client.check_map, map_id, samples)

    def update(self, on: Json, visits: Any) -> Json:
        """Return the answer of ``POST /v1/maps/{map_id}:update``, which is for stored maps."""
        map_id = _stored(on)
        return self._answer(schema.UpdateAnswer, Asked(map_id), self._client.update_map, map_id, visits)

    def put(self, map_id: str, document: Any) -> Json:
        """Store a map."""
        return self._answer(schema.MapSummaryAnswer, NOTHING, self._client.put_map, map_id, document)

    def get(self, map_id: str) -> Json:
        """Return a stored map."""
        return self._answer(schema.MapDocument, Asked(map_id), self._client.get_map, map_id)

    def maps(self) -> Iterator[Json]:
        """Yield the summary of each stored map, page by page."""
        cursor: str | None = None
        for _ in range(MAX_PAGES):
            page = self._answer(schema.MapList, NOTHING, self._client.list_maps, cursor=cursor)
            yield from page["maps"]
            if page["next"] is None:
                return
            cursor = str(page["next"])
        raise NoServerError(f"{self._url}: found more than {MAX_PAGES} pages of maps; check the URL")

    def remove(self, map_id: str) -> None:
        """Forget a stored map."""
        self._asked(Asked(map_id), self._client.delete_map, map_id)

    def analyze(self, body: Any) -> Json:
        """Return the answer of ``POST /v1/analyze``."""
        return self._answer(schema.AnalyzeAnswer, NOTHING, self._client.analyze, body)

    def _answer(self, kind: Any, asked: Asked, ask: Callable[..., Any], *arguments: Any, **options: Any) -> Json:
        """Return an answer whose fields are those of its route; further fields may be of a later version.

        Raises
        ------
        NoServerError
            When a field is missing, or of another type.
        """
        answer: Json = self._asked(asked, ask, *arguments, **options)
        try:
            _fields(kind).validate_python(answer)
        except ValidationError as error:
            wrong = error.errors(include_url=False)[0]
            place = "/" + "/".join(map(str, wrong["loc"]))
            raise NoServerError(
                f"the answer of {self._url} does not match this version of Linefix: {place}: {wrong['msg']}; "
                "check the URL and the version of the server"
            ) from None
        return answer

    def _asked(self, asked: Asked, ask: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
        try:
            return ask(*arguments, **options)
        except ProblemError as error:
            raise self._refusal(error, asked) from None
        except LinefixError as error:
            if error.__cause__ is None:  # a server answers, though none of Linefix
                raise NoServerError(f"{str(error).removesuffix('; check the URL')}; check the URL") from None
            raise NoServerError(
                f"no server responds at {self._url}: {error.__cause__}; start one with linefix serve, or omit --server"
            ) from None
        except ValueError as error:  # such as a number that JSON cannot have
            raise WrongUseError(f"not sent: {error}") from None

    def _refusal(self, error: ProblemError, asked: Asked) -> CommandError:
        if error.status == 401:
            return NoServerError(f"{self._url} requires a key; set {KEY} in the environment")
        if error.status == 403:
            return NoServerError(f"{self._url}: {error.detail}; set {KEY} in the environment to a key with this right")
        faults = [one for one in error.errors if isinstance(one.get("pointer"), str) and "message" in one]
        return error_of(error.status, error.code, f"{self._url}: {error.detail}", faults, asked)


def _stored(on: Json) -> str:
    """Return the id of a stored map.

    Raises
    ------
    WrongUseError
        When it is a map file.
    """
    map_id = id_of(on)
    if map_id is None:
        raise WrongUseError(
            "found a map file, expected the id of a stored map with --server; "
            "store it with linefix map put, or omit --server"
        )
    return map_id


@cache
def _fields(kind: Any) -> TypeAdapter[Any]:
    """Return what an answer is held to."""
    return TypeAdapter(kind)
