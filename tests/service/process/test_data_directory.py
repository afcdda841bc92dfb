"""A service that could keep no map does not start; one whose store is away for a while does."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from examples.running import free_port


def start(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "service", "--port", str(free_port()), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def test_a_directory_that_cannot_be_made_ends_the_start(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    ended = start("--data-dir", str(tmp_path / "file" / "maps"), "--workers", "2", "--searches", "2")
    assert ended.returncode == 1
    (line,) = ended.stderr.splitlines()
    assert str(tmp_path / "file" / "maps") in line
    assert "--data-dir" in line


def test_a_directory_in_which_nothing_can_be_made_ends_the_start() -> None:
    ended = start("--data-dir", "/proc/self")
    assert ended.returncode == 1
    assert "/proc/self" in ended.stderr
    assert "Traceback" not in ended.stderr
