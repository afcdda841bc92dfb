"""Keys in a file."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from service.admission.errors import UnknownKeyError
from service.admission.grants import EVERY_ROLE, Role
from service.admission.key_file import KeyFile, KeyFileError, read_keys
from service.admission.keys import Keyring
from service.commands.entry import run
from tests.service.issuing import key_lines

DIGEST = hashlib.sha256(b"sesame").hexdigest()


def test_a_new_key_is_good_for_what_was_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["key", 'the "robots"', "--role", "read", "--role", "associate", "--maps", "hq-"]) == 0
    lines, key = capsys.readouterr()
    assert key.strip() not in lines
    path = tmp_path / "keys.toml"
    path.write_text(lines)
    grant = Keyring([], KeyFile(path)).grant([(b"authorization", b"Bearer " + key.strip().encode())])
    assert (grant.roles, grant.maps) == ({Role.READ, Role.ASSOCIATE}, "hq-")
    assert run(["key", "admin"]) == 0
    path.write_text(capsys.readouterr().out)
    assert [(grant.roles, grant.maps) for grant in read_keys(path).values()] == [(EVERY_ROLE, "")]


@pytest.mark.parametrize("arguments", [["", "--maps", "x"], ["robots", "--maps", "hq/"], ["robots", "--role", "all"]])
def test_a_key_for_nothing_is_not_made(capsys: pytest.CaptureFixture[str], arguments: list[str]) -> None:
    assert run(["key", *arguments]) == 2
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("key", "no TOML"),
        ('[[key]]\nname = "a"\nsha256 = "sesame"', "sha256"),
        (f'[[key]]\nname = "a"\nsha256 = "{DIGEST}"\nroles = ["all"]', "roles"),
        (f'[[key]]\nname = "a"\nsha256 = "{DIGEST}"\nroles = []', "roles"),
        (f'[[key]]\nname = "a"\nsha256 = "{DIGEST}"\nmaps = "hq/"', "maps"),
        (f'[[key]]\nname = "a"\nsha256 = "{DIGEST}"\nmap = "hq-"', "map"),
        (key_lines("sesame", ["read"]) + key_lines("sesame", ["write"]), "twice"),
    ],
)
def test_a_file_that_is_wrong_is_named_and_not_repeated(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "file.toml"
    path.write_text(text)
    with pytest.raises(KeyFileError, match=message) as caught:
        KeyFile(path)
    assert str(path) in str(caught.value)
    assert "sesame" not in str(caught.value)
    assert DIGEST not in str(caught.value)


def test_an_empty_file_lets_nobody_in(tmp_path: Path) -> None:
    path = tmp_path / "keys.toml"
    path.write_text("")
    with pytest.raises(UnknownKeyError):
        Keyring([], KeyFile(path)).grant([(b"authorization", b"Bearer x")])


def test_a_file_that_is_gone_leaves_the_keys(tmp_path: Path) -> None:
    path = tmp_path / "keys.toml"
    path.write_text(key_lines("sesame", ["read"]))
    keys = KeyFile(path)
    path.unlink()
    keys.refresh()
    assert len(keys.grants) == 1
