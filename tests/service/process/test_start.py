"""Modules that a start loads and does not load."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

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
