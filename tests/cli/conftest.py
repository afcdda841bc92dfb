"""The command line, for the tests of its commands."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.batch.logs import SEEN, write_room

from .running import Linefix


@pytest.fixture
def linefix(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Linefix:
    return Linefix(folder, monkeypatch, capsys)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder that the commands run in, with a room and a scan in it."""
    write_room(tmp_path)
    (tmp_path / "scan.json").write_text(json.dumps({"segments": SEEN, "sigma": 0.02}))
    return tmp_path
