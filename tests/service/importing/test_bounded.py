"""The process that reads files of unknown senders: what it may take, and how it ends."""

from __future__ import annotations

import fcntl
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from threading import Timer

import pytest
from PIL import Image

from association import CancelledError, Deadline
from service.errors import FileTooLargeError, FormatsMissingError, ImportTooLateError
from service.importing import folders
from service.importing.bounded import ReadFiles, read_apart
from service.importing.folders import PREFIX, remove_abandoned
from service.importing.reader import Bounds
from tests.running import children_of, until

from .forms import SQUARE, TYPE, YAML, encoded, form


def curves(count: int) -> bytes:
    """Return a drawing that takes some twenty seconds where it has 200,000 curves."""
    return b'<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0' + b" C1 1 2 2 3 3" * count + b'"/></svg>'


BOUNDS = Bounds(1_000_000_000, 32_000_000, 200_000)


@pytest.fixture(autouse=True)
def _nothing_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> object:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    before = children_of(os.getpid())
    yield
    assert list(tmp_path.glob("linefix-*")) == []
    assert children_of(os.getpid()) <= before


def read(files: dict[str, bytes], bounds: Bounds = BOUNDS, deadline: Deadline | None = None) -> ReadFiles:
    return read_apart(form(files), TYPE, bounds, deadline or Deadline())


def test_more_memory_than_it_may_have() -> None:
    """A PNG of 80 KB that has 25 million pixels of four colours."""
    picture = Image.new("RGBA", (5000, 5000), (255, 255, 255, 254))
    with pytest.raises(FileTooLargeError, match="memory"):
        read({"a.yaml": YAML % b"a.png", "a.png": encoded(picture, "PNG")}, Bounds(300_000_000, 32_000_000, 200_000))


def test_more_of_a_processor_than_it_may_have() -> None:
    with pytest.raises(FileTooLargeError, match="processor"):
        read({"a.svg": curves(200_000)}, Bounds(4_000_000_000, 32_000_000, 200_000, cpu_seconds=1))


def test_it_ends_when_nobody_waits_or_the_time_is_over() -> None:
    with pytest.raises(ImportTooLateError):
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
    assert read({"a.csv": SQUARE}).head["report"]["format"] == "csv"


def test_where_the_extra_is_missing_it_is_named_and_no_secret_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A module in place of a reader prints what it finds."""
    (tmp_path / "contourpy.py").write_text(
        f"import os, pathlib\npathlib.Path({str(tmp_path / 'seen')!r}).write_text(repr(dict(os.environ)))\n"
        "raise ModuleNotFoundError('contourpy')"
    )
    monkeypatch.syspath_prepend(tmp_path)
    private = "LINEFIX_KEYS LINEFIX_KEYS_FILE LINEFIX_DATABASE_URL PGPASSWORD"
    for name in private.split():
        monkeypatch.setenv(name, "sesame")
    with pytest.raises(FormatsMissingError, match=r"lacks the extra `formats`"):
        read({"a.csv": SQUARE})
    assert "'PATH'" in (tmp_path / "seen").read_text()
    assert "sesame" not in (tmp_path / "seen").read_text()


def test_a_report_that_is_too_long_is_not_taken(tmp_path: Path) -> None:
    """Class of attack: an answer that is larger than its question. It is bounded by the system, not by the reader."""
    points = b"".join(b"%d,0,%d,1\n" % (k, k) for k in range(20_000))
    with pytest.raises(FileTooLargeError, match="found more"):
        read({"a.csv": b"x1,y1,x2,y2\n" + points}, Bounds(1_000_000_000, len(points) + 100, 200_000))


def test_files_of_a_service_that_was_killed_are_removed_by_the_next_import(tmp_path: Path) -> None:
    """Class of attack: what is left behind. Neither a folder in use, nor what a name of such a kind leads to, goes."""
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "kept").write_text("of somebody else")
    left, linked, used = (tmp_path / f"{PREFIX}{name}" for name in ("left", "linked", "used"))
    left.mkdir()
    (left / "file-0.csv").write_bytes(SQUARE)
    linked.symlink_to(elsewhere)
    used.mkdir()
    with used.joinpath("file-0.csv").open("wb"):
        descriptor = os.open(used, os.O_RDONLY)
        fcntl.flock(descriptor, fcntl.LOCK_EX)
    remove_abandoned(tmp_path)
    assert left.exists()  # as young as one that is not locked yet
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(folders, "YOUNG_SECONDS", 0.0)
        read({"a.csv": SQUARE})
    assert not left.exists()
    assert used.exists()
    assert (elsewhere / "kept").exists()
    os.close(descriptor)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(folders, "YOUNG_SECONDS", 0.0)
        remove_abandoned(tmp_path)
    linked.unlink()
    assert not used.exists()


def test_the_process_that_reads_removes_the_files_when_its_service_was_killed(tmp_path: Path) -> None:
    (tmp_path / "form").write_bytes(form({"a.svg": curves(20_000)}))
    reading = (
        "import pathlib, sys, tempfile; from association import Deadline; from service.importing.bounded import "
        "read_apart; from service.importing.reader import Bounds; tempfile.tempdir = sys.argv[1]; read_apart(bytearray("
        "pathlib.Path(sys.argv[1], 'form').read_bytes()), sys.argv[2], Bounds(10**9, 32_000_000, 9), Deadline())"
    )
    with subprocess.Popen([sys.executable, "-c", reading, str(tmp_path), TYPE]) as service:
        until(lambda: bool(list(tmp_path.glob(f"{PREFIX}*/file-0.svg"))))
        (child,) = children_of(service.pid)
        os.kill(service.pid, signal.SIGKILL)
        service.wait()
        os.kill(child, signal.SIGCONT)  # it is there, and goes on for some seconds
        until(lambda: not list(tmp_path.glob(f"{PREFIX}*")))
