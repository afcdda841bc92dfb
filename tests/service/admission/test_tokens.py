"""Tokens of an issuer, whose keys change."""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import jwt
import pytest
from pydantic import SecretStr

from service.admission import tokens
from service.admission.errors import UnknownKeyError
from service.admission.grants import Role
from service.admission.keys import Issuer, Keyring
from service.admission.tokens import Tokens
from tests.service.issuing import AUDIENCE, ISSUER, Issuing


class Website(ThreadingHTTPServer):
    """Gives the key set of an issuer."""

    def __init__(self) -> None:
        self.text, self.asked, self.elsewhere = "", 0, ""
        super().__init__(("127.0.0.1", 0), _Handler)

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}/keys"


class _Handler(BaseHTTPRequestHandler):
    server: Website

    def do_GET(self) -> None:
        self.server.asked += 1
        moved = self.server.elsewhere and self.path == "/keys"
        self.send_response(302 if moved else 200)
        if moved:
            self.send_header("Location", self.server.elsewhere)
        self.end_headers()
        self.wfile.write(self.server.text.encode())

    def log_message(self, format: str, *args: object) -> None:
        pass


@contextmanager
def website() -> Iterator[Website]:
    with Website() as made:
        threading.Thread(target=made.serve_forever, daemon=True).start()
        yield made
        made.shutdown()


def checking(where: object, **how: object) -> Tokens:
    made = Tokens(Issuer(ISSUER, AUDIENCE, str(where), **how))  # type: ignore[arg-type]
    made.refresh()
    return made


@pytest.fixture
def issued(tmp_path: Path) -> tuple[Issuing, Tokens]:
    issuing = Issuing()
    issuing.write(tmp_path / "keys.json")
    return issuing, checking(tmp_path / "keys.json")


def test_a_token_says_who_and_what(issued: tuple[Issuing, Tokens]) -> None:
    issuing, checks = issued
    grant = checks.grant(issuing.token(scope="linefix:read linefix:write linefix:all", linefix_maps="hq-").encode())
    assert (grant.roles, grant.maps) == ({Role.READ, Role.WRITE}, "hq-")
    # One who asks has one share, however many tokens; two have two.
    again, other = (checks.grant(issuing.token(sub=sub, jti=sub).encode()) for sub in ("robot", "other"))
    assert (grant.holder == again.holder, grant.holder == other.holder) == (True, False)
    assert checks.grant(issuing.token(scope=None).encode()).roles == frozenset()


@pytest.mark.parametrize(
    "claims",
    [
        {"scope": ["linefix:read"]},
        {"scope": 5},
        {"linefix_maps": 5},
        {"linefix_maps": ["hq-"]},
        {"linefix_maps": "hq/"},
        {"linefix_maps": "x" * 129},
    ],
)
def test_a_token_that_says_it_in_other_ways_says_nothing(
    issued: tuple[Issuing, Tokens], claims: dict[str, Any]
) -> None:
    issuing, checks = issued
    with pytest.raises(UnknownKeyError):
        checks.grant(issuing.token(**claims).encode())


def test_of_an_issuer_with_one_key_a_token_need_not_name_it(tmp_path: Path) -> None:
    issuing, other = Issuing(), Issuing("other")
    path = tmp_path / "keys.json"
    token = jwt.encode(jwt.decode(issuing.token(), options={"verify_signature": False}), issuing.private, "ES256")
    issuing.write(path)
    assert checking(path).grant(token.encode()).roles
    path.write_text(
        json.dumps({"keys": [key for one in (issuing, other) for key in json.loads(one.key_set())["keys"]]})
    )
    for checks in (checking(path), Tokens(Issuer(ISSUER, AUDIENCE, str(path)))):  # the latter has none yet
        with pytest.raises(UnknownKeyError):
            checks.grant(token.encode())


def test_tokens_are_taken_beside_keys(issued: tuple[Issuing, Tokens]) -> None:
    """What has the form of one and no issuer is a key that is not known."""
    issuing, checks = issued

    def sent(key: str) -> list[tuple[bytes, bytes]]:
        return [(b"authorization", b"Bearer " + key.encode())]

    both = Keyring([SecretStr("sesame"), SecretStr("a.b.c")], None, checks)
    for key in ("sesame", "a.b.c", issuing.token()):
        assert both.grant(sent(key)).holder
    for ring in (both, Keyring([SecretStr("sesame")])):
        for key in ("nothing", "nothing.at.all"):
            with pytest.raises(UnknownKeyError):
                ring.grant(sent(key))
    with pytest.raises(UnknownKeyError):
        Keyring([], None, checks).grant(sent("sesame"))


def test_a_keyring_fetches_the_keys_of_its_issuer(tmp_path: Path) -> None:
    issuing = Issuing()
    issuing.write(tmp_path / "keys.json")
    ring = Keyring([], None, Tokens(Issuer(ISSUER, AUDIENCE, str(tmp_path / "keys.json"))))
    sent = [(b"authorization", b"Bearer " + issuing.token().encode())]
    with pytest.raises(UnknownKeyError):
        ring.grant(sent)
    ring.refresh_tokens()
    assert ring.grant(sent).roles == {Role.ASSOCIATE}


def test_clocks_may_differ_a_little(tmp_path: Path) -> None:
    issuing = Issuing()
    issuing.write(tmp_path / "keys.json")
    past = issuing.token(exp=time.time() - 100).encode()
    assert checking(tmp_path / "keys.json", leeway=200.0).grant(past).roles
    with pytest.raises(UnknownKeyError):
        checking(tmp_path / "keys.json", leeway=30.0).grant(past)
    usual = checking(tmp_path / "keys.json")
    assert usual.grant(issuing.token(exp=time.time() - 20).encode()).roles
    with pytest.raises(UnknownKeyError):
        usual.grant(issuing.token(exp=time.time() - 30.5).encode())


def test_the_public_key_is_no_shared_secret(issued: tuple[Issuing, Tokens]) -> None:
    """A token's own word on how it was signed counts for nothing."""
    issuing, checks = issued
    claims = issuing.token().split(".")[1]
    for secret in (issuing.key_set().encode(), b""):
        head = base64.urlsafe_b64encode(json.dumps({"alg": "HS256", "kid": "one"}).encode()).rstrip(b"=").decode()
        signature = hmac.new(secret, f"{head}.{claims}".encode(), hashlib.sha256).digest()
        signed = f"{head}.{claims}.{base64.urlsafe_b64encode(signature).rstrip(b'=').decode()}"
        with pytest.raises(UnknownKeyError):
            checks.grant(signed.encode())


def test_only_the_algorithms_that_are_named(tmp_path: Path) -> None:
    issuing = Issuing()
    issuing.write(tmp_path / "keys.json")
    checks = checking(tmp_path / "keys.json", algorithms=("RS256",))
    with pytest.raises(UnknownKeyError):
        checks.grant(issuing.token().encode())


def test_a_new_key_is_looked_for_but_not_for_each_token(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tokens, "SOON_SECONDS", 0.2)
    old, new = Issuing("old"), Issuing("new")
    with website() as site:
        site.text = old.key_set()
        checks = checking(site.url)
        assert checks.grant(old.token().encode()).roles
        site.text = new.key_set()
        checks.refresh()
        assert site.asked == 1  # the key set was read once
        for _ in range(20):
            with pytest.raises(UnknownKeyError):
                checks.grant(new.token().encode())
            checks.refresh()
        time.sleep(0.2)
        checks.refresh()
        assert checks.grant(new.token().encode()).roles
        with pytest.raises(UnknownKeyError):
            checks.grant(old.token().encode())
        assert site.asked <= 3


def test_an_issuer_that_is_away_leaves_its_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tokens, "SOON_SECONDS", 0.0)
    monkeypatch.setattr(tokens, "REFRESH_SECONDS", 0.0)
    issuing = Issuing()
    with website() as site:
        site.text = issuing.key_set()
        checks = checking(site.url)
        # Elsewhere may be before and after it in the order of addresses.
        for text, elsewhere in (
            ("nothing", ""),
            *((Issuing().key_set(), to) for to in ("/other", "/A")),
        ):
            site.text, site.elsewhere = text, elsewhere
            checks.refresh()
            assert checks.grant(issuing.token().encode()).roles
    checks.refresh()
    assert checks.grant(issuing.token().encode()).roles
