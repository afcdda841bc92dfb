"""Bearer keys."""

from __future__ import annotations

from pathlib import Path

from pydantic import SecretStr

from service.admission.keys import Keyring, address_of
from tests.issuing import key_lines

RING = Keyring([SecretStr("sesame"), SecretStr("open")])


def sent(*values: bytes) -> list[tuple[bytes, bytes]]:
    return [(b"host", b"x"), *((b"authorization", value) for value in values)]


def test_each_key_is_a_holder_of_its_own() -> None:
    sesame, opened = RING.grant(sent(b"Bearer sesame")).holder, RING.grant(sent(b"Bearer open")).holder
    assert sesame is not None
    assert opened is not None
    assert sesame != opened
    for same in (b"bearer sesame", b"BEARER   sesame  "):
        assert RING.grant(sent(same)).holder == sesame
    # Nobody can tell the key from what is kept of it.
    assert b"sesame" not in sesame


def test_a_key_of_the_settings_may_do_everything_though_a_file_has_it_too(tmp_path: Path) -> None:
    (tmp_path / "keys").write_text(key_lines("sesame", ["read"], "hq-"))
    granted = Keyring([SecretStr("sesame")], tmp_path / "keys").grant(sent(b"Bearer sesame"))
    assert granted == RING.grant(sent(b"Bearer sesame"))
    assert Keyring([SecretStr("open")], tmp_path / "keys").grant(sent(b"Bearer sesame")).maps == "hq-"


def test_without_keys_whoever_comes_is_known_by_the_address() -> None:
    for values in ((), (b"Bearer sesame",), (b"x", b"y")):
        assert Keyring([]).grant(sent(*values), ("192.0.2.7", 5)).holder == bytes((192, 0, 2, 7))
        assert Keyring([]).grant(sent(*values)).holder is None


def test_a_client_has_one_address_whatever_the_port() -> None:
    same = [
        [("192.0.2.7", 1), ("192.0.2.7", 2), ("::ffff:192.0.2.7", 3)],
        # Who has one address of such a network has all of them.
        [("2001:db8:0:1::1", 1), ("2001:db8:0:1:ffff::2", 1)],
        [("fe80::1%eth0", 1), ("fe80::2%eth1", 1)],
        [("client.sock", 0)],
    ]
    found = [{address_of(client) for client in clients} for clients in same]
    assert [len(one) for one in found] == [1] * len(same)
    assert len(set.union(*found)) == len(same)
