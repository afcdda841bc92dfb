"""The command line, for the tests of its commands."""

from __future__ import annotations

from pathlib import Path

import pytest

from .running import Linefix


@pytest.fixture
def linefix(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Linefix:
    return Linefix(tmp_path, monkeypatch, capsys)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder that the commands run in."""
    return tmp_path
