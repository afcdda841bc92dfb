"""What is decided from a request's head."""

from __future__ import annotations

import pytest
from pydantic import SecretStr

from service.admission.entrance import SEARCHING, Entrance
from service.admission.errors import MissingKeyError, QueueFullError, ShareUsedError, UnknownKeyError
from service.admission.keys import Keyring
from service.admission.ticket import Ticket
from service.schemas.errors import BodyTooLargeError

from .gates import BlockedGate, gate_of, in_loop

LIMIT = 1000
KEYS = [SecretStr("sesame"), SecretStr("open")]


def entrance(gate: BlockedGate, keys: list[SecretStr] | None = None) -> Entrance:
    return Entrance(gate, Keyring(keys or []), LIMIT)


def key(name: str) -> list[tuple[bytes, bytes]]:
    return [(b"authorization", b"Bearer " + name.encode())]


def length(count: int) -> list[tuple[bytes, bytes]]:
    return [(b"content-length", b"%d" % count)]


@pytest.mark.parametrize("method", ["POST", "PUT"])
@pytest.mark.parametrize("path", ["/v1/associate", "/v1/maps/m", "/nothing"])
def test_a_body_that_says_it_is_too_long_is_sent_away(method: str, path: str) -> None:
    async def scenario() -> None:
        async with gate_of(1, 1) as gate:
            door = entrance(gate, KEYS)
            door.admit(method, path, length(LIMIT))
            with pytest.raises(BodyTooLargeError):
                door.admit(method, path, length(LIMIT + 1))

    in_loop(scenario)


def test_the_length_of_what_has_no_body_is_of_no_interest() -> None:
    async def scenario() -> None:
        async with gate_of(1, 1) as gate:
            for method in ("GET", "HEAD", "DELETE"):
                entrance(gate).admit(method, "/v1/maps/m", length(LIMIT + 1))
            entrance(gate).admit("POST", "/v1/associate", [(b"content-length", b"soon")])

    in_loop(scenario)


def test_a_ticket_says_whose_key_it_is_or_what_is_wrong_with_it() -> None:
    async def scenario() -> None:
        async with gate_of(1, 1) as gate:
            door = entrance(gate, KEYS)
            holders = {door.admit("POST", path, key("sesame")).holder for path in (*SEARCHING, "/v1/maps/m", "/livez")}
            assert holders == {Keyring(KEYS).holder(key("sesame"))}
            for headers, error in ((key("wrong"), UnknownKeyError), ([], MissingKeyError)):
                ticket = door.admit("POST", "/v1/associate", headers)
                assert ticket.holder is None
                with pytest.raises(error):
                    ticket.require_key()
            door.admit("GET", "/v1/limits", key("open")).require_key()

    in_loop(scenario)


def test_only_searches_are_sent_away_when_it_is_full() -> None:
    async def scenario() -> None:
        async with gate_of(1, 0) as gate:
            await gate.block()
            door = entrance(gate)
            for path in SEARCHING:
                with pytest.raises(QueueFullError):
                    door.admit("POST", path, [])
                door.admit("GET", path, [])
            for method, path in (("PUT", "/v1/maps/m"), ("GET", "/livez"), ("POST", "/v1/associate/"), ("POST", "/")):
                door.admit(method, path, [])

    in_loop(scenario)


def test_a_full_queue_is_looked_at_for_the_key_that_comes() -> None:
    async def scenario() -> None:
        async with gate_of(1, 1) as gate:
            door = entrance(gate, KEYS)
            for _ in range(2):
                door.admit("POST", "/v1/associate", key("sesame")).announce()
            with pytest.raises(QueueFullError):
                door.admit("POST", "/v1/associate", key("sesame"))
            door.admit("POST", "/v1/associate", key("open")).announce()
            with pytest.raises(ShareUsedError):
                door.admit("POST", "/v1/associate", key("sesame"))
            # What is wrong with a key is told by who asks for one, not by the queue.
            door.admit("POST", "/v1/associate", key("wrong"))

    in_loop(scenario)


def test_only_what_searches_is_expected_at_the_gate() -> None:
    async def scenario() -> None:
        async with gate_of(1, 0) as gate:
            door = entrance(gate, KEYS)
            for method, path, name in (
                ("POST", "/v1/associate", "wrong"),
                ("PUT", "/v1/maps/m", "sesame"),
                ("GET", "/v1/associate", "sesame"),
            ):
                door.admit(method, path, key(name)).announce()
                assert not gate.full
            ticket: Ticket = door.admit("POST", "/v1/associate", key("sesame"))
            assert not gate.full  # its body may never come
            ticket.announce()
            assert gate.full

    in_loop(scenario)


def test_a_ticket_keeps_nothing_of_what_led_to_it() -> None:
    """An exception that was raised holds every frame that it passed, and all that these hold."""

    async def scenario() -> None:
        async with gate_of(1, 0) as gate:
            assert isinstance(entrance(gate, KEYS).admit("GET", "/livez", []).key_error, type)

    in_loop(scenario)
