"""The wheel: the same anyone who builds it, and nothing in it but the packages."""

from __future__ import annotations

import os
import subprocess
import sys
import time
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def git(*arguments: str) -> list[str]:
    ended = subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True, text=True, check=False)
    if ended.returncode:
        pytest.skip("no repository")
    return ended.stdout.split("\0" if "-z" in arguments else "\n")


def test_two_builds_are_one_wheel_of_the_packages(tmp_path: Path) -> None:
    (told, *_) = git("log", "-1", "--format=%ct")
    packages = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]
    wanted = {name for name in git("ls-tree", "-r", "-z", "--name-only", "HEAD", *packages["packages"]) if name}
    environment = {**os.environ, "BIN": str(Path(sys.executable).parent), "DIST": str(tmp_path)}
    ended = subprocess.run([ROOT / ".ci" / "wheel"], env=environment, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    (path,) = tmp_path.iterdir()
    with zipfile.ZipFile(path) as wheel:
        names = {item.filename for item in wheel.infolist() if ".dist-info/" not in item.filename}
        assert names == wanted
        year, month, day, *_ = time.gmtime(int(told))
        assert {item.date_time[:3] for item in wheel.infolist()} == {(year, month, day)}
