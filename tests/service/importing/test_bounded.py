"""The process that reads files of strangers: what it may take, and how it ends."""

from __future__ import annotations

import os
import time
from pathlib import Path
from threading import Timer

import pytest
from PIL import Image

from association import CancelledError, Deadline
from service.importing.bounded import ReadMap, read_apart
from service.importing.bounds import Bounds
from service.importing.errors import FileTooLargeError, FormatsMissingError, TooLateError
from tests.running import children_of

from .forms import SQUARE, TYPE, YAML, encoded, form

BOUNDS = Bounds(1_000_000_000, 32_000_000, 200_000)


@pytest.fixture(autouse=True)
def _nothing_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> object:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    before = children_of(os.getpid())
    yield
    assert list(tmp_path.glob("linefix-*")) == []
    assert children_of(os.getpid()) <= before


def read(files: dict[str, bytes], bounds: Bounds = BOUNDS, deadline: Deadline | None = None) -> ReadMap:
    return read_apart(form(files), TYPE, bounds, deadline or Deadline())


def test_more_memory_than_it_may_have() -> None:
    """A PNG of 80 KB that has 25 million pixels of four colours."""
    picture = Image.new("RGBA", (5000, 5000), (255, 255, 255, 254))
    with pytest.raises(FileTooLargeError, match="memory"):
        read({"a.yaml": YAML % b"a.png", "a.png": encoded(picture, "PNG")}, Bounds(300_000_000, 32_000_000, 200_000))


def test_more_of_a_processor_than_it_may_have() -> None:
    """Curves that take some twenty seconds."""
    curves = b'<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0' + b" C1 1 2 2 3 3" * 200_000 + b'"/></svg>'
    with pytest.raises(FileTooLargeError, match="processor"):
        read({"a.svg": curves}, Bounds(4_000_000_000, 32_000_000, 200_000, cpu_seconds=1))


def test_more_segments_than_a_map_may_have() -> None:
    with pytest.raises(FileTooLargeError, match="at most 3 segments"):
        read({"a.csv": SQUARE}, Bounds(1_000_000_000, 32_000_000, 3))


def test_it_ends_when_nobody_waits_or_the_time_is_over() -> None:
    with pytest.raises(TooLateError):
        read({"a.csv": SQUARE}, deadline=Deadline(time.monotonic()))
    gone = Deadline()
    Timer(0.1, gone.cancel).start()
    with pytest.raises(CancelledError):
        read({"a.csv": SQUARE}, deadline=gone)


def test_what_stands_in_the_working_folder_is_not_taken_for_the_service(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "service").mkdir()
    (tmp_path / "service" / "__init__.py").write_text("raise SystemExit(3)")
    monkeypatch.chdir(tmp_path)
    assert read({"a.csv": SQUARE}).report["format"] == "csv"


def test_where_the_extra_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "contourpy.py").write_text("raise ModuleNotFoundError('contourpy')")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(FormatsMissingError, match=r"linefix\[formats\]"):
        read({"a.csv": SQUARE})


def test_it_is_told_no_secrets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A module that stands in for one of the readers tells what it sees."""
    (tmp_path / "contourpy.py").write_text(
        f"import os, pathlib\npathlib.Path({str(tmp_path / 'seen')!r}).write_text(repr(dict(os.environ)))\n"
        "raise ModuleNotFoundError('contourpy')"
    )
    monkeypatch.syspath_prepend(tmp_path)
    private = "LINEFIX_KEYS LINEFIX_KEYS_FILE LINEFIX_DATABASE_URL PGPASSWORD OTEL_EXPORTER_OTLP_HEADERS"
    for name in private.split():
        monkeypatch.setenv(name, "sesame")
    with pytest.raises(FormatsMissingError):
        read({"a.csv": SQUARE})
    assert "'PATH'" in (tmp_path / "seen").read_text()
    assert "sesame" not in (tmp_path / "seen").read_text()
