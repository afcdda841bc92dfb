"""The service that a command asks: the server at a URL, or this process and the store of maps of this machine."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

from linefix.documents.errors import Fault

from .errors import NO_NAMES, Names, NoServerError, NoSuchMapError, RefusedError, WrongUseError, refused_at, refusing
from .options import option
from .printing import Json, compile_first

if TYPE_CHECKING:
    from linefix.answering import LocalService

Locate = Callable[[Json], Json]
"""From the scan and the prior of a request to the answer."""

KEY = "LINEFIX_KEY"  # in the environment: arguments are seen by everyone on a machine
SECONDS = 120.0  # to wait for an answer: more than the longest deadline that a service has by default
OF_STORED = ("check_map", "update_map")  # a server has them for stored maps
OF_STORE = ("put_map", "get_map", "list_maps", "delete_map")
BUSY = (401, 403, 408, 429)  # of 4xx those that do not concern the content sent
_HEADER = re.compile(r"[!-~]+")
_URL = re.compile(r"https?://([!-~]+@)?([a-z0-9._-]+|\[[0-9a-f:.]+\])(:[0-9]{1,5})?(/[!-~]*)?", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Where:
    """The service to ask, as an option."""

    server: str | None = option(None, "Use the service at this URL; the key is read from LINEFIX_KEY.", "URL")

    def opened(self) -> AbstractContextManager[Here | Server]:
        """Give the service, for several requests."""
        return nullcontext(Here()) if self.server is None else server_at(self.server)

    def ask(self, method: str, *arguments: Any, names: Names = NO_NAMES, **more: Any) -> Json:
        """Return an answer, see `Here.ask`."""
        with self.opened() as service:
            return service.ask(method, *arguments, names=names, **more)

    def whole_map(self, on: Json) -> Json:
        """Return the map of a request itself, also where it is stored; raises `RefusedError` where it is gone."""
        return on if "segments" in on or "map_id" not in on else self.ask("get_map", on["map_id"])


class Here:
    """The process of the command, and the store of maps of this machine."""

    def ask(self, method: str, *arguments: Any, names: Names = NO_NAMES, **more: Any) -> Json:
        """Return what a method of a service's client returns.

        Parameters
        ----------
        method : str
            Of the client, of `linefix.answering.LocalService`, or of the store.
        arguments
            Of the method; the map of a request in place of an id for a check or an update.
        names : mapping
            The user's names for places in the request.
        more
            Arguments by name.
        """
        if method in OF_STORE:
            from .stored import stored_maps

            service: Any = stored_maps("".join(arguments[:1]), names)
        else:
            service = answering(names)
        with service as opened:
            answer: Json = getattr(opened, method)(*arguments, **more)
            return answer

    def locating(self, target: Json, options: Json, names: Names) -> Locate:
        """Index the map, or the maps, of a request once; return the function that searches scans there."""
        with answering(names) as service:
            return refusing(names)(service.locating(target, options))


@contextmanager
def answering(names: Names) -> Iterator[LocalService]:
    """Give what answers requests in this process, once it can search; raises as `refusing`."""
    from linefix.answering import LocalService

    compile_first()
    with refusing(names):
        yield LocalService(_stored)


def _stored(map_id: str) -> tuple[Any, Json]:
    from .stored import stored_maps

    with stored_maps(map_id) as maps:
        return maps.found(map_id)


@contextmanager
def server_at(url: str) -> Iterator[Server]:
    """Give the server at a URL; raises `WrongUseError` without the client, or where URL or key are none."""
    try:
        from linefix_client import Client
    except ModuleNotFoundError as error:
        raise WrongUseError(
            f"--server needs {error.name}: in a checkout, pip install ./clients/python, or omit --server"
        ) from None
    if not _URL.fullmatch(url):
        found = "one with a name or a password" if "@" in url else repr(url)
        raise WrongUseError(f"--server: expected a URL such as http://127.0.0.1:8000, found {found}")
    key = os.environ.get(KEY) or None
    if key is not None and not _HEADER.fullmatch(key):
        raise WrongUseError(f"{KEY} in the environment: found a character that no key has, expected printable ASCII")
    with Client(url, key, timeout=SECONDS) as client:
        yield Server(url.rstrip("/"), client)


class Server:
    """A server; its errors are those of the command line."""

    def __init__(self, url: str, client: Any) -> None:
        self._url, self._client = url, client

    def locating(self, target: Json, options: Json, names: Names) -> Locate:
        """Return the function that searches scans on the map, or the maps, of a request."""
        return lambda sought: self.ask("associate", {**target, **sought, "options": options}, names=names)

    def ask(self, method: str, *arguments: Any, names: Names = NO_NAMES, **more: Any) -> Json:
        """Return an answer whose fields are those of its route; further fields may be of a later version.

        Raises
        ------
        NoServerError
            When no server answers, or a field is missing or of another type.
        """
        from linefix_client import LinefixError, ProblemError
        from pydantic import ValidationError

        if method in OF_STORED:
            arguments = (self._id_of(arguments[0]), *arguments[1:])
        try:
            answer: Json = getattr(self._client, method)(*arguments, **more)
            _fields(method).validate_python(answer)
            return answer
        except ValidationError as error:
            wrong = error.errors(include_url=False)[0]
            place = "/" + "/".join(map(str, wrong["loc"]))
            raise NoServerError(
                f"the answer of {self._url} does not match this version of Linefix: {place}: {wrong['msg']}; "
                "check the URL and the version of the server"
            ) from None
        except ProblemError as error:
            raise self._refusal(error, arguments, names) from None
        except LinefixError as error:
            remedy = "check the URL, start a server with linefix serve, or omit --server"
            raise NoServerError(f"{str(error).removesuffix('; check the URL')}; {remedy}") from None
        except ValueError as error:  # such as a number that JSON cannot have
            raise WrongUseError(f"not sent: {error}") from None

    def _id_of(self, on: Json) -> str:
        """Return the id of a stored map; raises `WrongUseError` where it is a map file."""
        if "map_id" not in on:
            raise WrongUseError(
                "found a map file, expected the id of a stored map with --server; "
                f"store it with linefix map put ID FILE --server {self._url}, or omit --server"
            )
        return str(on["map_id"])

    def _refusal(self, error: Any, arguments: tuple[Any, ...], names: Names) -> RefusedError | NoServerError:
        if error.status == 401:
            return NoServerError(f"{self._url} requires a key; set {KEY} in the environment")
        if error.status == 403:
            return NoServerError(f"{self._url}: {error.detail}; set {KEY} in the environment to a key with this right")
        on = arguments[0] if arguments else None
        map_id = on.get("map", {}).get("map_id") if isinstance(on, dict) else on
        if error.code == "unknown_map" and isinstance(map_id, str):
            return NoSuchMapError(map_id, f"--server {self._url}")
        found = [one for one in error.errors if one.keys() >= {"pointer", "message"}]
        faults = [Fault(str(one["pointer"]), one["message"]) for one in found]
        refused = refused_at(faults or [Fault("", f"{self._url}: {error.detail}")], names)
        return refused if 400 <= error.status < 500 and error.status not in BUSY else NoServerError(str(refused))


@cache
def _fields(method: str) -> Any:
    """Return what the answer of a method of the client is held to."""
    from typing import get_type_hints

    from linefix_client import Client
    from pydantic import TypeAdapter

    return TypeAdapter(get_type_hints(getattr(Client, method))["return"])
