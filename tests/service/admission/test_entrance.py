"""Decisions from the head of a request."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import SecretStr
from starlette.routing import compile_path

from linefix.documents.errors import BodyTooLargeError
from service.admission.entrance import Entrance, search_of
from service.admission.errors import (
    ForeignHostError,
    ForeignMapError,
    MissingKeyError,
    MissingRoleError,
    QueueFullError,
    ShareUsedError,
    UnknownKeyError,
)
from service.admission.grants import ROUTES, asked_of
from service.admission.key_file import KeyFile
from service.admission.keys import Keyring
from service.admission.origins import Origins
from service.admission.ticket import Ticket
from tests.service.issuing import key_lines

from .gates import BlockedGate, gate_of, in_loop

LIMIT = 1000
SEARCHING = (
    "/v1/associate",
    "/v1/associate:batch",
    "/v1/register",
    "/v1/vectorize",
    "/v1/maps:import",
    "/v1/analyze",
)
KEYS = [SecretStr("sesame"), SecretStr("open")]


class Door(Entrance):
    """An entrance, asked without all that a scope has."""

    def ask(self, method: str, path: str, headers: list[tuple[bytes, bytes]]) -> Ticket:
        return self.admit({"method": method, "path": path, "headers": headers, "client": ("192.0.2.1", 1)})


def entrance(gate: BlockedGate, keys: list[SecretStr] | None = None) -> Door:
    return Door(gate, Keyring(keys or []), Origins((), guarded=bool(keys)), LIMIT)


def key(name: str) -> list[tuple[bytes, bytes]]:
    return [(b"authorization", b"Bearer " + name.encode())]


def length(count: int) -> list[tuple[bytes, bytes]]:
    return [(b"content-length", b"%d" % count)]


def test_what_needs_a_turn_at_the_gate() -> None:
    """Counted under its route, without the id of a map."""
    for path in SEARCHING:
        assert search_of("POST", path) == path
        assert search_of("GET", path) is None
    for method in ("GET", "HEAD", "POST"):
        assert search_of(method, "/v1/maps/hq-3:check") == "/v1/maps/{map_id}:check"
        assert search_of(method, "/v1/maps/hq-3") is None
    assert search_of("POST", "/v1/maps/hq-3:analyze") == "/v1/maps/{map_id}:analyze"
    assert search_of("PUT", "/v1/maps/hq-3:check") is None
    assert search_of("GET", "/v2/maps/hq-3:check") is None


@pytest.mark.parametrize(
    "end", ["", "\n", "\n\n", "\r", "\u2028", "/", ":check", ":check\n", "x" * 110 + ":check"], ids=ascii
)
def test_the_table_reads_a_path_as_the_router_does(end: str) -> None:
    """With a line's end behind it a route stood under another line of the table, or under none: no early refusal."""
    for route in ROUTES:
        path = route.path.replace("{map_id}", "hq-3") + end
        for method in route.methods.split():
            same = (one for one in ROUTES if method in one.methods.split() and compile_path(one.path)[0].match(path))
            assert asked_of(method, path).access == next(same, None), path


def test_the_table_is_asked_for_no_longer_paths_than_a_route_can_have() -> None:
    path = "/v1/maps/".ljust(256, "x")
    assert asked_of("GET", path).map_id == path.removeprefix("/v1/maps/")
    assert asked_of("GET", path + "x").access is None


@in_loop
async def test_a_lesser_key_is_for_what_was_said_and_no_more(tmp_path: Path) -> None:
    """Any key may ask how much a request may hold; what is not in the table is for keys that may do everything."""

    (tmp_path / "keys").write_text(
        key_lines("reads", ["read"]) + key_lines("all of hq", ["read", "associate", "write"], "hq-")
    )
    keyring = Keyring([SecretStr("all")], KeyFile(tmp_path / "keys"))

    async with gate_of(1, 1) as gate:
        door = Door(gate, keyring, Origins((), guarded=True), LIMIT)
        assert door.ask("GET", "/v1/maps/hq-3", key("all of hq")).maps == "hq-"
        for name in ("reads", "all of hq", "all"):
            door.ask("GET", "/v1/limits", key(name))
            door.ask("GET", "/v1/maps", key(name))
        for name, path in (("reads", "/v1/maps/hq-3"), ("all", "/v1/maps/hq-3"), ("all", "/v1/nothing")):
            door.ask("GET", path, key(name))
        for name, method, path, lacking in (
            ("reads", "PUT", "/v1/maps/hq-3", "the role `write`"),
            ("reads", "POST", "/v1/associate", "the role `associate`"),
            ("reads", "GET", "/v1/nothing", "every role"),
            ("all of hq", "GET", "/v1/nothing", "every role"),
        ):
            with pytest.raises(MissingRoleError, match=f"the key lacks {lacking}"):
                door.ask(method, path, key(name))
        with pytest.raises(ForeignMapError):
            door.ask("GET", "/v1/maps/other", key("all of hq"))


@pytest.mark.parametrize("method", ["POST", "PUT"])
@pytest.mark.parametrize("path", ["/v1/associate", "/v1/maps/m", "/nothing"])
@in_loop
async def test_a_body_that_says_it_is_too_long_is_sent_away(method: str, path: str) -> None:
    async with gate_of(1, 1) as gate:
        door = entrance(gate, KEYS)
        door.ask(method, path, length(LIMIT) + key("open"))
        with pytest.raises(BodyTooLargeError):
            door.ask(method, path, length(LIMIT + 1) + key("open"))


@in_loop
async def test_the_length_of_what_has_no_body_is_of_no_interest() -> None:
    async with gate_of(1, 1) as gate:
        for method in ("GET", "HEAD", "DELETE"):
            entrance(gate).ask(method, "/v1/maps/m", length(LIMIT + 1))
        entrance(gate).ask("POST", "/v1/associate", [(b"content-length", b"soon")])


@in_loop
async def test_a_ticket_says_whose_key_it_is() -> None:
    async with gate_of(1, 1) as gate:
        door = entrance(gate, KEYS)
        holders = {door.ask("POST", path, key("sesame")).holder for path in (*SEARCHING, "/v1/maps/m")}
        assert holders == {Keyring(KEYS).grant(key("sesame")).holder}


@in_loop
async def test_who_has_no_key_is_sent_away_at_once() -> None:
    async with gate_of(1, 1) as gate:
        door = entrance(gate, KEYS)
        for path in (*SEARCHING, "/v1/maps/m", "/v1/nothing", "/v1/"):
            for headers, error in ((key("wrong"), UnknownKeyError), ([], MissingKeyError)):
                with pytest.raises(error):
                    door.ask("POST", path, headers)
        for path in ("/livez", "/v1", "/docs"):
            assert door.ask("GET", path, key("wrong")).holder is None


@in_loop
async def test_without_keys_an_address_is_a_holder() -> None:
    async with gate_of(1, 1) as gate:
        door = entrance(gate)
        for method, path in (("POST", "/v1/associate"), ("GET", "/v1/maps")):
            assert door.ask(method, path, []).holder == bytes((192, 0, 2, 1))
        with pytest.raises(ForeignHostError):
            door.ask("GET", "/v1/maps", [(b"host", b"evil.example")])


@in_loop
async def test_only_searches_are_sent_away_when_it_is_full() -> None:
    async with gate_of(1, 0) as gate:
        await gate.block()
        door = entrance(gate)
        for path in SEARCHING:
            with pytest.raises(QueueFullError):
                door.ask("POST", path, [])
            door.ask("GET", path, [])
        for method, path in (("PUT", "/v1/maps/m"), ("GET", "/livez"), ("POST", "/v1/associate/"), ("POST", "/")):
            door.ask(method, path, [])


@in_loop
async def test_a_full_queue_is_looked_at_for_the_key_that_comes() -> None:
    async with gate_of(1, 1) as gate:
        door = entrance(gate, KEYS)
        for _ in range(2):
            door.ask("POST", "/v1/associate", key("sesame")).announce()
        with pytest.raises(QueueFullError):
            door.ask("POST", "/v1/associate", key("sesame"))
        door.ask("POST", "/v1/associate", key("open")).announce()
        with pytest.raises(ShareUsedError):
            door.ask("POST", "/v1/associate", key("sesame"))
        # A wrong key is reported before a full queue.
        with pytest.raises(UnknownKeyError):
            door.ask("POST", "/v1/associate", key("wrong"))


@in_loop
async def test_only_what_searches_is_expected_at_the_gate() -> None:
    async with gate_of(1, 0) as gate:
        door = entrance(gate, KEYS)
        for method, path, name in (
            ("PUT", "/v1/maps/m", "sesame"),
            ("GET", "/v1/associate", "sesame"),
        ):
            door.ask(method, path, key(name)).announce()
            assert not gate.full
        ticket: Ticket = door.ask("POST", "/v1/associate", key("sesame"))
        assert not gate.full  # its body may never come
        ticket.announce()
        assert gate.full
