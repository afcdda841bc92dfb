"""Bearer keys, and keys in a file."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest
from pydantic import SecretStr

from cli.entry import run
from service.admission.keys import EVERY_ROLE, KeyFileError, Keyring, Role, address_of, read_keys
from service.errors import UnknownKeyError
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


DIGEST = hashlib.sha256(b"sesame").hexdigest()


def test_a_new_key_is_good_for_what_was_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["key", 'the "robots"', "--role", "read", "--role", "associate", "--maps", "hq-"]) == 0
    lines, key = capsys.readouterr()
    assert key.strip() not in lines
    path = tmp_path / "keys.toml"
    path.write_text(lines)
    grant = Keyring([], path).grant([(b"authorization", b"Bearer " + key.strip().encode())])
    assert (grant.roles, grant.maps) == ({Role.READ, Role.ASSOCIATE}, "hq-")
    assert run(["key", "admin"]) == 0
    path.write_text(capsys.readouterr().out)
    assert [(grant.roles, grant.maps) for grant in read_keys(path).values()] == [(EVERY_ROLE, "")]


def test_a_byte_order_mark_is_no_part_of_a_key(tmp_path: Path) -> None:
    path = tmp_path / "keys.toml"
    path.write_text(key_lines("sesame", ["read"]), encoding="utf-8-sig")
    assert [grant.roles for grant in read_keys(path).values()] == [{Role.READ}]
    path.write_text(key_lines("sesame", ["read"]), encoding="utf-16")
    with pytest.raises(KeyFileError, match="is not TOML in UTF-8"):
        read_keys(path)


@pytest.mark.parametrize(
    "arguments",
    [["", "--maps", "x"], ["robots", "--maps", ""], ["robots", "--maps", "hq/"], ["robots", "--role", "all"]],
)
def test_a_key_for_nothing_is_not_made(capsys: pytest.CaptureFixture[str], arguments: list[str]) -> None:
    assert run(["key", *arguments]) == 2
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("key", "is not TOML"),
        ('[[key]]\nname = "a"\nsha256 = "sesame"', "sha256"),
        (f'[[key]]\nname = "a"\nsha256 = "{DIGEST}"\nroles = ["all"]', "roles"),
        (f'[[key]]\nname = "a"\nsha256 = "{DIGEST}"\nroles = []', "roles"),
        (f'[[key]]\nname = "a"\nsha256 = "{DIGEST}"\nmaps = "hq/"', "maps"),
        (f'[[key]]\nname = "a"\nsha256 = "{DIGEST}"\nmaps = ""', "maps"),
        (f'[[key]]\nname = "a"\nsha256 = "{DIGEST}"\nmap = "hq-"', "map"),
        (f'[[key]]\nname = "a"\nsha256 = "{DIGEST}"\nmaps = "{"x" * 129}"', "maps"),
        (f'[[key]]\nname = ""\nsha256 = "{DIGEST}"', "name"),
        (f'[[key]]\nname = "{"x" * 65}"\nsha256 = "{DIGEST}"', "name"),
        (key_lines("sesame", ["read"]) + key_lines("sesame", ["write"]), "twice"),
    ],
)
def test_a_file_that_is_wrong_is_named_and_not_repeated(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "file.toml"
    path.write_text(text)
    with pytest.raises(KeyFileError, match=message) as caught:
        Keyring([], path)
    assert str(path) in str(caught.value)
    assert "sesame" not in str(caught.value)
    assert DIGEST not in str(caught.value)


def test_names_and_maps_may_be_that_long(tmp_path: Path) -> None:
    path = tmp_path / "keys.toml"
    path.write_text(f'[[key]]\nname = "{"x" * 64}"\nsha256 = "{DIGEST}"\nmaps = "{"y" * 128}"')
    assert [grant.maps for grant in read_keys(path).values()] == ["y" * 128]


@pytest.mark.parametrize(("name", "message"), [("none", "No such file"), ("x" * 300, "too long")])
def test_a_file_that_cannot_be_read_is_named(tmp_path: Path, name: str, message: str) -> None:
    with pytest.raises(KeyFileError, match=f"{name}.*{message}"):
        Keyring([], tmp_path / name)


def test_the_files_of_a_directory_count_together(tmp_path: Path) -> None:
    """As secrets are mounted: behind a hidden directory that changes as a whole, with links in front of it."""
    (tmp_path / "..data").mkdir()
    (tmp_path / "..data" / "one").write_text(key_lines("one", ["read"]))
    (tmp_path / "one").symlink_to(tmp_path / "..data" / "one")
    (tmp_path / "two").write_text(key_lines("two", ["write"]))
    (tmp_path / ".two.swp").write_text("of an editor")
    assert [grant.roles for grant in read_keys(tmp_path).values()] == [{Role.READ}, {Role.WRITE}]
    (tmp_path / "three").write_text(key_lines("one", ["write"]))
    with pytest.raises(KeyFileError, match="twice"):
        read_keys(tmp_path)


def test_an_empty_file_lets_nobody_in(tmp_path: Path) -> None:
    path = tmp_path / "keys.toml"
    path.write_text("")
    with pytest.raises(UnknownKeyError):
        Keyring([], path).grant([(b"authorization", b"Bearer x")])


def test_a_file_that_is_gone_leaves_the_keys(tmp_path: Path) -> None:
    path = tmp_path / "keys.toml"
    path.write_text(key_lines("sesame", ["read"]))
    keys = Keyring([], path)
    path.unlink()
    keys.refresh()
    assert len(keys.grants) == 1
