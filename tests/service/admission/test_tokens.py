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

import pytest

from service.admission import tokens
from service.admission.errors import UnknownKeyError
from service.admission.grants import Role
from service.admission.issuer import Issuer
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


def test_clocks_may_differ_a_little(tmp_path: Path) -> None:
    issuing = Issuing()
    issuing.write(tmp_path / "keys.json")
    past = issuing.token(exp=time.time() - 100).encode()
    assert checking(tmp_path / "keys.json", leeway=200.0).grant(past).roles
    with pytest.raises(UnknownKeyError):
        checking(tmp_path / "keys.json", leeway=30.0).grant(past)


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
        assert site.asked == 1  # nobody has asked for another
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
        for text, elsewhere in (("nothing", ""), ('{"keys": []}', ""), (Issuing().key_set(), "/other")):
            site.text, site.elsewhere = text, elsewhere
            checks.refresh()
            assert checks.grant(issuing.token().encode()).roles
    checks.refresh()
    assert checks.grant(issuing.token().encode()).roles
