"""The JSON Web Key Set (RFC 7517) of an issuer: fetched within bounds of time and size, and only what may verify."""

from __future__ import annotations

import json
import socket
import threading
import time
import urllib.request
from contextlib import suppress
from functools import partial
from http.client import HTTPConnection, HTTPSConnection
from pathlib import Path
from typing import Any

import jwt
from cryptography.hazmat.primitives.asymmetric import ec, ed448, ed25519, rsa

READ_SECONDS = 5.0  # s for each step of a fetch: connecting, the handshake, one read
TOTAL_SECONDS = 10.0  # s from the connection to the end, so that a server that sends a byte now and then ends, too
MOST_BYTES = 1_000_000
MOST_KEYS = 1000
LEAST_RSA_BITS = 2048  # RFC 7518, 3.3
PUBLIC = (rsa.RSAPublicKey, ec.EllipticCurvePublicKey, ed25519.Ed25519PublicKey, ed448.Ed448PublicKey)

Keys = dict[str | None, jwt.PyJWK]


class KeySetError(Exception):
    """No key set is available; the message gives the reason, and repeats nothing of what was sent."""


def read_key_set(where: str) -> Keys:
    """Return the keys of a set by their ids; those that are of no use for signatures are left out.

    Parameters
    ----------
    where : str
        Path or URL.

    Raises
    ------
    KeySetError
        When it cannot be had within `TOTAL_SECONDS` and `MOST_BYTES`, or is no key set.
    """
    try:
        told = json.loads(_fetched(where) if "://" in where else _read(Path(where)))
    except KeySetError:
        raise
    except Exception as error:  # a server can send anything, and fails in as many ways
        raise KeySetError(type(error).__name__) from error
    keys = told.get("keys") if isinstance(told, dict) else None
    if not isinstance(keys, list) or len(keys) > MOST_KEYS:
        raise KeySetError(f"expected an object whose `keys` are a list of at most {MOST_KEYS}")
    return {key.key_id: key for key in map(_key_of, keys) if key is not None}


def _key_of(told: Any) -> jwt.PyJWK | None:
    """Return a key that may verify signatures; None of any other."""
    if not isinstance(told, dict) or told.get("use", "sig") != "sig":
        return None
    may = told.get("key_ops", ["verify"])
    if not isinstance(may, list) or "verify" not in may:
        return None
    if not isinstance(told.get("kid", ""), str):
        return None
    try:
        key = jwt.PyJWK(told)
    except Exception:  # of a kind that is not known here, or broken
        return None
    if not isinstance(key.key, PUBLIC):
        return None
    return None if isinstance(key.key, rsa.RSAPublicKey) and key.key.key_size < LEAST_RSA_BITS else key


def _read(path: Path) -> bytes:
    with path.open("rb") as file:
        content = file.read(MOST_BYTES + 1)
    return _bounded(content)


def _bounded(content: bytes) -> bytes:
    if len(content) > MOST_BYTES:
        raise KeySetError(f"expected at most {MOST_BYTES} bytes")
    return content


def _fetched(url: str) -> bytes:
    """Return the content of a URL; redirects are refused."""
    with _Watch() as watch:
        opener = urllib.request.build_opener(_NoRedirect, _Http(watch), _Https(watch))
        with opener.open(url, timeout=READ_SECONDS) as answer:
            content: bytes = answer.read(MOST_BYTES + 1)
        if watch.is_over:
            raise KeySetError(f"expected an answer within {TOTAL_SECONDS:g} s")
    return _bounded(content)


class _Watch:
    """Ends the connections of one fetch when its time is over: timeouts of a socket are for one read each."""

    def __init__(self) -> None:
        self._end = time.monotonic() + TOTAL_SECONDS
        self._sockets: list[socket.socket] = []
        self._timer = threading.Timer(TOTAL_SECONDS, self._end_all)
        self._timer.daemon = True

    def __enter__(self) -> _Watch:
        self._timer.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._timer.cancel()

    @property
    def is_over(self) -> bool:
        """True when the time is over."""
        return time.monotonic() >= self._end

    def add(self, connection: socket.socket) -> None:
        """Watch a connection, too."""
        self._sockets.append(connection)
        if self.is_over:
            self._end_all()

    def _end_all(self) -> None:
        for connection in self._sockets:
            with suppress(OSError):  # closed meanwhile
                connection.shutdown(socket.SHUT_RDWR)


class _WatchedHttp(HTTPConnection):
    def __init__(self, host: str, *, watch: _Watch, **how: Any) -> None:
        super().__init__(host, **how)
        self._watch = watch

    def connect(self) -> None:
        super().connect()
        self._watch.add(self.sock)


class _WatchedHttps(HTTPSConnection):
    def __init__(self, host: str, *, watch: _Watch, **how: Any) -> None:
        super().__init__(host, **how)
        self._watch = watch

    def connect(self) -> None:
        super().connect()
        self._watch.add(self.sock)


class _Http(urllib.request.HTTPHandler):
    def __init__(self, watch: _Watch) -> None:
        super().__init__()
        self._watch = watch

    def http_open(self, req: urllib.request.Request) -> Any:
        return self.do_open(partial(_WatchedHttp, watch=self._watch), req)


class _Https(urllib.request.HTTPSHandler):
    def __init__(self, watch: _Watch) -> None:
        super().__init__()
        self._watch = watch

    def https_open(self, req: urllib.request.Request) -> Any:
        return self.do_open(partial(_WatchedHttps, watch=self._watch), req)


class _NoRedirect(urllib.request.HTTPRedirectHandler):
    def redirect_request(self, *_: Any) -> None:
        """Return no request: an answer that leads elsewhere is an error."""
