"""Starts: modules that one loads, and directories with which there is none."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
from pathlib import Path

from examples.running import free_port

# Loaded by the first request that needs them.
LATER = ("cryptography", "ezdxf", "psycopg", "rosbags", "scipy.ndimage")
PROGRAM = f"""
import asyncio, gc, json, sys
from service.app import create_app
from service.settings import Settings

async def start(app):
    async with app.router.lifespan_context(app):
        while not app.state.services.readiness.warm:
            await asyncio.sleep(0.01)
        return {{"loaded": [name for name in {LATER} if name in sys.modules], "collects": gc.isenabled(),
                "frozen": gc.get_freeze_count() > 100_000}}

gc.disable()
print(json.dumps(asyncio.run(start(create_app(Settings(data_dir=sys.argv[1]))))))
"""


def test_a_start_loads_nothing_that_waits_and_then_collects_garbage(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM, str(tmp_path)], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout) == {"loaded": [], "collects": True, "frozen": True}


def start(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "service", "--port", str(free_port()), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def test_a_port_in_use_ends_the_start_in_one_line(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        ended = start("--data-dir", str(tmp_path), "--port", str(port))
    assert ended.returncode == 1
    (line,) = ended.stderr.splitlines()
    assert f"cannot listen on 127.0.0.1, port {port}" in line
    assert "--port" in line


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
