"""Settings: from where, which are refused, and the database that a URL names."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from service.database_location import database_url
from service.serving import unknown_settings
from service.settings import SettingsError, read_settings


@pytest.fixture(autouse=True)
def _no_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in os.environ if name.startswith("LINEFIX_")]:
        monkeypatch.delenv(name)


def test_without_keys_only_loopback(monkeypatch: pytest.MonkeyPatch) -> None:
    for host in ("127.0.0.1", "::1", "localhost"):
        read_settings(["--host", host])
    monkeypatch.setenv("LINEFIX_ALLOW_ANONYMOUS", "1")
    read_settings(["--host", "0.0.0.0"])
    monkeypatch.delenv("LINEFIX_ALLOW_ANONYMOUS")
    monkeypatch.setenv("LINEFIX_KEYS", " sesame, two ,")
    settings = read_settings(["--host", "0.0.0.0"])
    assert [key.get_secret_value() for key in settings.keys] == ["sesame", "two"]
    assert "sesame" not in repr(settings)


# Arguments or the environment, and what the message names.
REFUSED: list[tuple[str, str]] = [
    *((f"--host={host}", "LINEFIX_KEYS") for host in ("0.0.0.0", "::", "192.168.1.4", "example.org")),
    ("--queue=-1", "queue"),
    ("--workers=3 --searches=2", "workers"),
    # Everyone on the machine can see a key that is an argument.
    *((argument, "LINEFIX_KEYS") for argument in ("--keys sesame", "--keys=sesame")),
    # Blank keys made a service unusable, or open to all clients.
    *((f"LINEFIX_KEYS={value}", "keys") for value in (" ", ",", "  , ", "two words", "caf\xe9", "a\tb")),
    *((f"LINEFIX_{name.upper()}={value}", name)
      for name in ("max_deadline_ms", "request_timeout_s", "drain_s") for value in ("inf", "nan", "-inf", "1e400")),
    *((f"LINEFIX_CORS_ORIGINS={origin}", "cors_origins")
      for origin in ("*", "fleet.example", "https://fleet.example/", "https://fleet.example/page", "null")),
]  # fmt: skip


@pytest.mark.parametrize(("said", "named"), REFUSED, ids=[repr(said) for said, _ in REFUSED])
def test_a_wrong_setting_is_named(monkeypatch: pytest.MonkeyPatch, said: str, named: str) -> None:
    arguments = said.split() if said.startswith("-") else []
    if not arguments:
        monkeypatch.setenv(*said.split("=", 1))
    with pytest.raises(SettingsError, match=named) as caught:
        read_settings(arguments)
    assert "sesame" not in str(caught.value)


@pytest.mark.parametrize(
    ("environment", "arguments", "said"),
    [({}, ["--host", "0.0.0.0"], "LINEFIX_ALLOW_ANONYMOUS"),
     ({b"LINEFIX_DATA_DIR": b"/tmp/\xff\xfe"}, [], "linefix: LINEFIX_DATA_DIR: expected UTF-8\n")],
    ids=["without keys", "bytes that are no text"],
)  # fmt: skip
def test_a_wrong_setting_ends_the_start(environment: dict[bytes, bytes], arguments: list[str], said: str) -> None:
    command = [sys.executable, "-m", "service", *arguments]
    env = {**os.environb, **environment}
    ended = subprocess.run(command, env=env, capture_output=True, text=True, timeout=60, check=False)
    assert (ended.returncode, said in ended.stderr, "Traceback" in ended.stderr) == (2, True, False)


def test_a_misspelt_setting_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LINEFIX_PROT", "81")
    monkeypatch.setenv("LINEFIX_PORT", "81")
    assert unknown_settings() == ["LINEFIX_PROT"]


def test_limits_are_the_settings_of_the_same_kind() -> None:
    said = "--max-values 1001 --max-map-segments 2 --max-scan-segments 3 --max-beams 4 --max-correspondences 5"
    limits = read_settings([*said.split(), "--max-batch", "6"]).limits()
    assert (limits.values, limits.map_segments, limits.scan_segments) == (1001, 2, 3)
    assert (limits.beams, limits.pairs, limits.batch) == (4, 5, 6)


def test_keys_that_are_set_to_nothing_are_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LINEFIX_KEYS", "")
    assert read_settings([]).keys == ()


def test_the_help_is_for_people(capsys: pytest.CaptureFixture[str]) -> None:
    """Types and functions of the program are no help."""
    with pytest.raises(SystemExit) as ended:
        read_settings(["--help"])
    assert ended.value.code == 0
    text = capsys.readouterr().out
    words = ("_data_home", "factory", "SecretStr", "tuple", "null", "{", "--host str", "--port int", "==")
    assert [word for word in words if word in text] == []
    flat = " ".join(text.split())
    assert "--keys-file PATH" in flat
    assert "--keys " not in flat
    assert "(default: ~/.local/share/linefix)" in flat


@pytest.mark.parametrize("text", ["mysql://u:sesame@h/d", "nothing", "postgresql+asyncpg://u:sesame@h/d", ""])
def test_a_url_that_is_of_no_use(text: str) -> None:
    with pytest.raises(ValueError, match="expected a URL") as caught:
        database_url(text)
    assert "sesame" not in str(caught.value)


@pytest.mark.parametrize("begin", ["postgres", "postgresql", "postgresql+psycopg"])
def test_postgresql_by_any_name(begin: str) -> None:
    assert database_url(f"{begin}://u@h/d").drivername == "postgresql+psycopg"
