"""Settings: from where, which are refused, and the database that a URL names."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from service.database_location import database_url
from service.serving import unknown_settings
from service.settings import Settings, SettingsError, read_settings


@pytest.fixture(autouse=True)
def _no_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in os.environ if name.startswith("LINEFIX_")]:
        monkeypatch.delenv(name)


def test_the_command_line_beats_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LINEFIX_PORT", "81")
    monkeypatch.setenv("LINEFIX_QUEUE", "3")
    settings = read_settings(["--port", "82"])
    assert (settings.host, settings.port, settings.queue) == ("127.0.0.1", 82, 3)


def test_without_keys_only_loopback(monkeypatch: pytest.MonkeyPatch) -> None:
    for host in ("0.0.0.0", "::", "192.168.1.4", "example.org"):
        with pytest.raises(SettingsError, match="LINEFIX_KEYS"):
            read_settings(["--host", host])
    for host in ("127.0.0.1", "::1", "localhost"):
        read_settings(["--host", host])
    monkeypatch.setenv("LINEFIX_ALLOW_ANONYMOUS", "1")
    read_settings(["--host", "0.0.0.0"])
    monkeypatch.delenv("LINEFIX_ALLOW_ANONYMOUS")
    monkeypatch.setenv("LINEFIX_KEYS", " sesame, two ,")
    settings = read_settings(["--host", "0.0.0.0"])
    assert [key.get_secret_value() for key in settings.keys] == ["sesame", "two"]
    assert "sesame" not in repr(settings)


def test_a_wrong_setting_is_named_and_ends_the_start() -> None:
    with pytest.raises(SettingsError, match="queue"):
        read_settings(["--queue", "-1"])
    command = [sys.executable, "-m", "service", "--host", "0.0.0.0"]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 2
    assert "LINEFIX_ALLOW_ANONYMOUS" in ended.stderr
    assert "Traceback" not in ended.stderr


def test_a_misspelt_setting_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LINEFIX_PROT", "81")
    monkeypatch.setenv("LINEFIX_PORT", "81")
    assert unknown_settings() == ["LINEFIX_PROT"]


def test_limits_are_the_settings_of_the_same_kind() -> None:
    said = "--max-values 1001 --max-map-segments 2 --max-scan-segments 3 --max-beams 4 --max-correspondences 5"
    limits = read_settings([*said.split(), "--max-batch", "6"]).limits()
    assert (limits.values, limits.map_segments, limits.scan_segments) == (1001, 2, 3)
    assert (limits.beams, limits.pairs, limits.batch) == (4, 5, 6)


def test_another_process_reads_the_same_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "environ", {**os.environ, "linefix_port": "81", "LINEFIX_KEYS": "sesame, two"})
    settings = read_settings(["--port", "82", "--hosts", "a.example,b.example", "--allow-anonymous"])
    settings.export()
    assert Settings() == settings
    assert settings.port == 82


def test_no_more_workers_than_searches() -> None:
    assert read_settings(["--workers", "2", "--searches", "2"]).workers == 2
    with pytest.raises(SettingsError, match="workers"):
        read_settings(["--workers", "3", "--searches", "2"])


@pytest.mark.parametrize("value", [" ", ",", "  , ", "two words", "caf\xe9", "a\tb"])
def test_keys_that_nobody_could_send_are_refused(monkeypatch: pytest.MonkeyPatch, value: str) -> None:
    """Blank keys made a service unusable, or open to all clients."""
    monkeypatch.setenv("LINEFIX_KEYS", value)
    with pytest.raises(SettingsError, match="keys"):
        read_settings([])


def test_keys_that_are_set_to_nothing_are_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LINEFIX_KEYS", "")
    assert read_settings([]).keys == ()


@pytest.mark.parametrize("name", ["max_deadline_ms", "request_timeout_s", "drain_s"])
@pytest.mark.parametrize("value", ["inf", "nan", "-inf", "1e400"])
def test_times_are_finite(monkeypatch: pytest.MonkeyPatch, name: str, value: str) -> None:
    monkeypatch.setenv(f"LINEFIX_{name.upper()}", value)
    with pytest.raises(SettingsError, match=name):
        read_settings([])


def test_what_is_not_utf_8_is_named() -> None:
    environment = {**os.environb, b"LINEFIX_DATA_DIR": b"/tmp/\xff\xfe"}
    command = [sys.executable, "-m", "service"]
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60, check=False)
    assert (ended.returncode, ended.stderr) == (2, "linefix: LINEFIX_DATA_DIR: expected UTF-8\n")


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


@pytest.mark.parametrize("arguments", [["--keys", "sesame"], ["--keys=sesame"]])
def test_a_key_is_no_argument(arguments: list[str]) -> None:
    """Everyone on the machine can see it there."""
    with pytest.raises(SettingsError, match="LINEFIX_KEYS") as caught:
        read_settings(arguments)
    assert "sesame" not in str(caught.value)


@pytest.mark.parametrize("text", ["mysql://u:sesame@h/d", "nothing", "postgresql+asyncpg://u:sesame@h/d", ""])
def test_a_url_that_is_of_no_use(text: str) -> None:
    with pytest.raises(ValueError, match="expected a URL") as caught:
        database_url(text)
    assert "sesame" not in str(caught.value)


@pytest.mark.parametrize("begin", ["postgres", "postgresql", "postgresql+psycopg"])
def test_postgresql_by_any_name(begin: str) -> None:
    assert database_url(f"{begin}://u@h/d").drivername == "postgresql+psycopg"
