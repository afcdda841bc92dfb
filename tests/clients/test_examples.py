"""The examples in other languages, run as they say; where a language is missing its example is left out."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.running import RunningService

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
FOUND = "x 1.000 m, y 1.000 m, theta 1.5708 rad"


def said(*command: str) -> str:
    ended = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


@pytest.mark.skipif(shutil.which("node") is None, reason="no node")
def test_javascript(service: RunningService) -> None:
    assert FOUND in said("node", str(EXAMPLES / "call.mjs"), service.url)


@pytest.mark.skipif(shutil.which("curl") is None, reason="no curl")
def test_curl(service: RunningService) -> None:
    answer = json.loads(said("sh", str(EXAMPLES / "call.sh"), service.url))
    assert answer["usable"]
    assert abs(answer["pose"]["x"] - 1.0) < 1e-6


@pytest.mark.skipif(shutil.which("g++") is None or shutil.which("curl-config") is None, reason="no g++ or libcurl")
def test_cpp(service: RunningService, tmp_path: Path) -> None:
    program = str(tmp_path / "call")
    said("g++", "-std=c++17", "-Wall", "-Wextra", "-Werror", str(EXAMPLES / "call.cpp"), "-lcurl", "-o", program)
    assert FOUND in said(program, service.url)
