"""The target of a command: the server at a URL, or this process and the store of maps of this machine."""

from __future__ import annotations

import math
import os
import re
import urllib.parse
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from .errors import (
    NOTHING,
    Asked,
    CommandError,
    NoServerError,
    NoSuchMapError,
    RefusedError,
    WrongUseError,
    refused_at,
    refusing,
)
from .printing import Json
from .progress import compile_first

if TYPE_CHECKING:
    from linefix.answering import Within

    from .stored import StoredMaps

N = TypeVar("N", int, float)
KEY = "LINEFIX_KEY"  # in the environment: arguments are seen by everyone on a machine
SECONDS = 120.0  # to wait for an answer: more than the longest deadline that a service has by default
MAX_PAGES = 100_000  # of a list of maps
MOST_SCANS = 10**9  # of an update: each is read from a file of this machine
OF_STORED = {"check": "check_map", "update": "update_map"}  # methods of the client: a server has them for stored maps
LIMITS = {  # by the name of the setting
    "MAX_VALUES": "values",
    "MAX_MAP_SEGMENTS": "map_segments",
    "MAX_SCAN_SEGMENTS": "scan_segments",
    "MAX_BEAMS": "beams",
    "MAX_CORRESPONDENCES": "pairs",
}
BUSY = (401, 403, 408, 429)  # of 4xx those that do not concern the content sent
_HEADER = re.compile(r"[!-~]+")


def _about(first: Any) -> Asked:
    """Return the subject of a request, of the map of one, or of the id of a map."""
    on = first.get("map", first) if isinstance(first, dict) else first
    map_id = on.get("map_id") if isinstance(on, dict) else on
    return Asked(map_id if isinstance(map_id, str) else None)


def ask(question: str, server: str | None, *documents: Any, **more: Any) -> Json:
    """Return the answer to a question of `linefix.answering`: of the server at a URL, else of this process.

    The first document is a request, or the map of a check or an update; `more` is for this process alone.
    """
    if server is not None:
        sent = (_stored(documents[0]), *documents[1:]) if question in OF_STORED else documents
        with server_at(server) as remote:
            return remote.call(f"{question.title()}Answer", OF_STORED.get(question, question), *sent)
    with answering(_about(documents[0])) as within:
        from linefix import answering as library

        answer: Json = getattr(library, question)(*documents, within, **more)
        return answer


@contextmanager
def answering(asked: Asked = NOTHING) -> Iterator[Within]:
    """Give the bounds of requests in this process, once it can search; raises as `refusing`."""
    from linefix.answering import Within
    from linefix.documents.limits import Limits

    compile_first()
    limits = {name: setting(variable, getattr(Limits(), name)) for variable, name in LIMITS.items()}
    with refusing(asked):
        yield Within(Limits(**limits, batch=MOST_SCANS), setting("MAX_DEADLINE_MS", Within().deadline_ms), _stored_here)


def setting(name: str, default: N) -> N:
    """Return a number of the environment, as the service has it; raises `WrongUseError` where it is none."""
    text = os.environ.get(f"LINEFIX_{name}")
    try:
        value = default if text is None else type(default)(text)
    except ValueError:
        value = type(default)(-1)
    if not 0 < value < math.inf:
        raise WrongUseError(f"LINEFIX_{name} in the environment: found {text!r}, expected a number above 0")
    return value


def _stored_here(map_id: str) -> tuple[Any, Json]:
    from .stored import StoredMaps

    with closing(StoredMaps()) as maps:
        return maps.found(map_id)


@contextmanager
def keeping(server: str | None) -> Iterator[Server | StoredMaps]:
    """Give the stored maps: those of the server at a URL, or those of this machine where there is none."""
    if server is not None:
        with server_at(server) as remote:
            yield remote
        return
    from .stored import StoredMaps

    with closing(StoredMaps()) as maps:
        yield maps


def whole_map(on: Json, server: str | None) -> Json:
    """Return the map of a request itself, also where the request has its id; raises `RefusedError` where it is gone."""
    if "segments" in on or "map_id" not in on:
        return on
    with keeping(server) as maps:
        return maps.get(on["map_id"])


@contextmanager
def server_at(url: str) -> Iterator[Server]:
    """Give the server at a URL.

    Raises
    ------
    RefusedError
        When the client is not installed.
    WrongUseError
        When the URL is none, or no header can hold the key.
    """
    try:
        from linefix_client import Client
    except ModuleNotFoundError as error:
        raise RefusedError(
            f"--server needs {error.name}: in a checkout, pip install ./clients/python, or omit --server"
        ) from None
    try:
        parts = urllib.parse.urlsplit(url)
        named = parts.scheme in ("http", "https") and parts.hostname is not None and parts.port != 0
    except ValueError:
        named = False
    if not named or not _HEADER.fullmatch(url):
        found = "one with a name or a password" if "@" in url else repr(url)
        raise WrongUseError(f"--server: expected a URL such as http://127.0.0.1:8000, found {found}")
    key = os.environ.get(KEY) or None
    if key is not None and not _HEADER.fullmatch(key):
        raise WrongUseError(
            f"{KEY} in the environment: found a space or a character that a header "
            "cannot contain, expected a key of printable ASCII"
        )
    with Client(url, key, timeout=SECONDS) as client:
        yield Server(url.rstrip("/"), client)


class Server:
    """A server; its errors are those of the command line."""

    def __init__(self, url: str, client: Any) -> None:
        self._url, self._client = url, client

    def import_map(self, files: list[Path], fields: Json) -> Json:
        """Return the answer of ``POST /v1/maps:import``."""
        named, asked = [(file.name, file.read_bytes()) for file in files], Asked(files=tuple(f.name for f in files))
        return self.call("ImportAnswer", "import_map", named, fields, asked=asked)

    def put(self, map_id: str, document: Json) -> Json:
        """Store a map."""
        return self.call("MapSummaryAnswer", "put_map", map_id, document)

    def get(self, map_id: str) -> Json:
        """Return a stored map."""
        return self.call("MapDocument", "get_map", map_id)

    def maps(self) -> Iterator[Json]:
        """Yield the summary of each stored map, page by page."""
        cursor: str | None = None
        for _ in range(MAX_PAGES):
            page = self.call("MapList", "list_maps", cursor=cursor)
            yield from page["maps"]
            if page["next"] is None:
                return
            cursor = str(page["next"])
        raise NoServerError(f"{self._url}: found more than {MAX_PAGES} pages of maps; check the URL")

    def remove(self, map_id: str) -> None:
        """Forget a stored map."""
        self._asked(Asked(map_id), lambda: self._client.delete_map(map_id))

    def call(self, kind: str, method: str, *arguments: Any, asked: Asked | None = None, **options: Any) -> Json:
        """Return an answer whose fields are those of its route; further fields may be of a later version.

        Raises
        ------
        NoServerError
            When a field is missing, or of another type.
        """
        from pydantic import ValidationError

        about = asked or (_about(arguments[0]) if arguments else NOTHING)
        answer: Json = self._asked(about, lambda: getattr(self._client, method)(*arguments, **options))
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

    def _asked(self, asked: Asked, call: Callable[[], Any]) -> Any:
        from linefix_client import LinefixError, ProblemError

        try:
            return call()
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

    def _refusal(self, error: Any, asked: Asked) -> CommandError:
        if error.status == 401:
            return NoServerError(f"{self._url} requires a key; set {KEY} in the environment")
        if error.status == 403:
            return NoServerError(f"{self._url}: {error.detail}; set {KEY} in the environment to a key with this right")
        if error.code == "unknown_map" and asked.map_id is not None:
            return NoSuchMapError(asked.map_id)
        named = [one for one in error.errors if isinstance(one.get("pointer"), str) and "message" in one]
        faults = [(one["pointer"], one["message"]) for one in named]
        detail = ": ".join((*asked.files[:1], f"{self._url}: {error.detail}"))
        refused = refused_at(faults, asked) if faults else RefusedError(detail)
        return refused if 400 <= error.status < 500 and error.status not in BUSY else NoServerError(str(refused))


@cache
def _fields(kind: str) -> Any:
    """Return what an answer is held to."""
    from linefix_client import schema
    from pydantic import TypeAdapter

    return TypeAdapter(getattr(schema, kind))


def _stored(on: Json) -> str:
    """Return the id of a stored map; raises `WrongUseError` where it is a map file."""
    if "map_id" not in on:
        raise WrongUseError(
            "found a map file, expected the id of a stored map with --server; "
            "store it with linefix map put, or omit --server"
        )
    return str(on["map_id"])
