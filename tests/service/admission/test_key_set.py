"""Class of attack: a server that is relied on is slow, endless or wrong, or its keys are not for signatures."""

from __future__ import annotations

import base64
import json
import socket
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import jwt
import pytest
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from jwt.algorithms import ECAlgorithm, RSAAlgorithm

from service.admission import key_set, tokens
from service.admission.errors import UnknownKeyError
from service.admission.key_set import KeySetError, read_key_set
from service.admission.keys import Issuer
from service.admission.tokens import Tokens
from tests.running import RunningService, client_of, until
from tests.service.issuing import AUDIENCE, ISSUER, Issuing, key_lines

HEAD = b"HTTP/1.1 200 OK\r\nContent-Type: application/json\r\n"


@contextmanager
def serving(answer: Callable[[socket.socket], None]) -> Iterator[int]:
    """Answer each connection in a thread, until the block ends; gives the port."""
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def one(connection: socket.socket) -> None:
            with connection, suppress(OSError):
                answer(connection)

        def serve() -> None:
            with suppress(OSError):
                while True:
                    threading.Thread(target=one, args=(listener.accept()[0],), daemon=True).start()

        threading.Thread(target=serve, daemon=True).start()
        yield listener.getsockname()[1]
        listener.shutdown(socket.SHUT_RDWR)


def dripping(before: bytes) -> Callable[[socket.socket], None]:
    def answer(connection: socket.socket) -> None:
        connection.recv(4096)
        connection.sendall(before)
        while True:
            connection.sendall(b"a")
            time.sleep(0.05)

    return answer


def silent(connection: socket.socket) -> None:
    while connection.recv(4096):
        pass


def endless(connection: socket.socket) -> None:
    connection.recv(4096)
    connection.sendall(HEAD + b"\r\n")
    while True:
        connection.sendall(b" " * 65536)


def pouring(connection: socket.socket) -> None:
    connection.recv(4096)
    while True:
        connection.sendall(b"X-A: " + b"a" * 60_000 + b"\r\n")


@pytest.mark.parametrize(
    ("scheme", "answer"),
    [
        ("http", dripping(HEAD + b"\r\n")),
        ("http", dripping(HEAD + b"X-Slow: ")),
        ("http", dripping(HEAD + b"Transfer-Encoding: chunked\r\n\r\n1")),
        ("http", dripping(HEAD + b"Content-Length: 999999\r\n\r\n")),
        ("http", silent),
        ("http", endless),
        ("http", pouring),
        ("https", silent),
        ("https", dripping(b"")),
        ("https", dripping(b"\x16\x03\x03\x40\x00")),
    ],
)
def test_a_fetch_ends(monkeypatch: pytest.MonkeyPatch, scheme: str, answer: Callable[[socket.socket], None]) -> None:
    monkeypatch.setattr(key_set, "READ_SECONDS", 0.5)
    monkeypatch.setattr(key_set, "TOTAL_SECONDS", 0.8)
    with serving(answer) as port, pytest.raises(KeySetError):
        read_key_set(f"{scheme}://127.0.0.1:{port}/keys")


@pytest.mark.parametrize(
    "told", ["[]", "null", "5", '"keys"', "{}", '{"keys": {}}', '{"keys": 5}', "[" * 100_000, "", "\xff"]
)
def test_what_is_no_key_set_is_refused(tmp_path: Path, told: str) -> None:
    (tmp_path / "keys").write_text(told, encoding="latin-1")
    with pytest.raises(KeySetError):
        read_key_set(str(tmp_path / "keys"))


def test_no_end_of_a_file_is_waited_for() -> None:
    with pytest.raises(KeySetError, match="bytes"):
        read_key_set("/dev/zero")


def redirect_to(port: int) -> Callable[[socket.socket], None]:
    def answer(connection: socket.socket) -> None:
        connection.recv(4096)
        connection.sendall(b"HTTP/1.1 302 Found\r\nLocation: http://127.0.0.1:%d/inside\r\n\r\n" % port)

    return answer


def test_a_key_set_leads_nowhere_else() -> None:
    """Class of attack: a request forged by the server. No request reaches the other address."""
    asked: list[bytes] = []
    with (
        serving(lambda connection: asked.append(connection.recv(4096))) as inside,
        serving(redirect_to(inside)) as port,
        pytest.raises(KeySetError),
    ):
        read_key_set(f"http://127.0.0.1:{port}/keys")
    assert asked == []


def ec_jwk(**more: Any) -> dict[str, Any]:
    public = ec.generate_private_key(ec.SECP256R1()).public_key()
    return {**ECAlgorithm.to_jwk(public, as_dict=True), "alg": "ES256", **more}


def rsa_jwk(bits: int, **more: Any) -> dict[str, Any]:
    public = rsa.generate_private_key(65537, bits).public_key()
    return {**RSAAlgorithm.to_jwk(public, as_dict=True), "alg": "RS256", **more}


def private_jwk() -> dict[str, Any]:
    return {**ECAlgorithm.to_jwk(ec.generate_private_key(ec.SECP256R1()), as_dict=True), "alg": "ES256"}


SECRET = base64.urlsafe_b64encode(b"x" * 32).decode()


# Keys are drawn, so that their text cannot name a test: each process of a test run draws others.
UNFIT = (
    "encryption",
    "use_is_a_list",
    "encrypts",
    "operations_are_no_list",
    "short",
    "short_for_signatures",
    "private",
    "symmetric",
    "no_point",
    "new_type",
    "number_as_name",
    "list",
    "null",
)


@pytest.mark.parametrize(
    "unfit",
    [
        ec_jwk(use="enc"),
        ec_jwk(use=["sig"]),
        ec_jwk(key_ops=["encrypt"]),
        ec_jwk(key_ops="verify"),
        rsa_jwk(1024),
        rsa_jwk(1024, use="sig"),
        private_jwk(),
        {"kty": "oct", "k": SECRET, "alg": "HS256"},
        {"kty": "EC", "crv": "P-256", "x": "AA", "y": "AA"},
        {"kty": "new"},
        {"kid": 5, **ec_jwk()},
        [],
        None,
    ],
    ids=UNFIT,
)
def test_only_what_verifies_signatures_is_a_key(tmp_path: Path, unfit: Any) -> None:
    if isinstance(unfit, dict) and unfit.get("kid") != 5:
        unfit = {"kid": "unfit", **unfit}
    fit = [ec_jwk(kid="one"), ec_jwk(kid="two", use="sig", key_ops=["verify"]), rsa_jwk(2048, kid="three")]
    (tmp_path / "keys").write_text(json.dumps({"keys": [unfit, *fit]}))
    assert set(read_key_set(str(tmp_path / "keys"))) == {"one", "two", "three"}


def test_an_rsa_token_of_a_short_key_is_refused(tmp_path: Path) -> None:
    for bits, taken in ((1024, False), (2048, True)):
        private = rsa.generate_private_key(65537, bits)
        public = RSAAlgorithm.to_jwk(private.public_key(), as_dict=True)
        (tmp_path / "keys").write_text(json.dumps({"keys": [{**public, "kid": "one"}]}))
        checks = Tokens(Issuer(ISSUER, AUDIENCE, str(tmp_path / "keys")))
        checks.refresh()
        claims = {"iss": ISSUER, "aud": AUDIENCE, "sub": "robot", "exp": time.time() + 60}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that the key is short
            token = jwt.encode(claims, private, "RS256", {"kid": "one"})
        if taken:
            assert checks.grant(token.encode()).holder
        else:
            with pytest.raises(UnknownKeyError):
                checks.grant(token.encode())


def test_keys_that_an_issuer_has_taken_back_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Class of attack: a key that was taken back. A set without keys is one."""
    monkeypatch.setattr(tokens, "REFRESH_SECONDS", 0.0)
    issuing = Issuing()
    issuing.write(tmp_path / "keys")
    checks = Tokens(Issuer(ISSUER, AUDIENCE, str(tmp_path / "keys")))
    checks.refresh()
    assert checks.grant(issuing.token().encode()).roles
    (tmp_path / "keys").write_text('{"keys": []}')
    checks.refresh()
    with pytest.raises(UnknownKeyError):
        checks.grant(issuing.token().encode())


def test_keys_of_an_issuer_that_is_away_for_long_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tokens, "REFRESH_SECONDS", 0.0)
    monkeypatch.setattr(tokens, "SOON_SECONDS", 0.0)
    issuing = Issuing()
    issuing.write(tmp_path / "keys")
    checks = Tokens(Issuer(ISSUER, AUDIENCE, str(tmp_path / "keys")))
    checks.refresh()
    (tmp_path / "keys").unlink()
    checks.refresh()
    assert checks.grant(issuing.token().encode()).roles
    monkeypatch.setattr(tokens, "LONGEST_SECONDS", 0.0)
    checks.refresh()
    with pytest.raises(UnknownKeyError):
        checks.grant(issuing.token().encode())


def test_a_key_that_was_taken_back_is_refused_though_the_issuer_is_silent(
    start_service: Callable[..., RunningService], tmp_path: Path
) -> None:
    """The service becomes ready, too."""
    keys = tmp_path / "keys.toml"
    keys.write_text(key_lines("sesame", ["read"]) + key_lines("other", ["read"]))
    with serving(silent) as port:
        url = f"http://127.0.0.1:{port}/keys"
        running = start_service(keys_file=keys, jwt_issuer=ISSUER, jwt_audience=AUDIENCE, jwt_keys=url)
        with client_of(running.url, authorization="Bearer sesame") as client:
            assert client.get("/v1/maps").status_code == 200
            keys.write_text(key_lines("other", ["read"]))
            until(lambda: client.get("/v1/maps").status_code == 403)
        assert "the issuer's keys cannot be fetched" in running.log()
