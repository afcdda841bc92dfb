"""linefix batch, as a user runs it."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from tests.batch.logs import rows, write_log

from .running import Linefix


def test_batch_writes_one_row_a_scan_and_tells_what_is_in_them(tmp_path: Path, linefix: Linefix) -> None:
    write_log(tmp_path / "a.parquet", 30)
    asked = ("batch", "a.parquet", "--maps", "room.json", "--out", "out/poses.parquet", "--block", "10")
    ended = linefix(*asked, "--workers", "1")
    assert pq.read_schema(tmp_path / "out/poses.parquet").names[:5] == ["log", "index", "stamp", "map_id", "status"]
    assert (ended.code, ended.err) == (0, "")  # progress is for terminals
    told = [line.split() for line in ended.out.splitlines()]
    assert ["scans", "30"] in told
    assert ["ok", "30"] in told
    written = [(row["index"], row["status"]) for row in rows(tmp_path / "out/poses.parquet")]
    assert written == [(k, "ok") for k in range(30)]


def test_a_missing_extra_is_named_with_its_package() -> None:
    script = "import sys; sys.modules['pyarrow'] = None; from cli.entry import main; main()"
    command = [sys.executable, "-c", script, "batch", "a.parquet", "--maps", "room.json", "--out", "poses.parquet"]
    ended = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).parents[2], check=False)
    assert (ended.returncode, ended.stdout) == (3, "")
    assert 'needs the package pyarrow, of the extra batch: in a checkout, pip install ".[batch]"' in ended.stderr


@pytest.mark.long
def test_a_batch_that_was_killed_goes_on(tmp_path: Path, linefix: Linefix) -> None:
    write_log(tmp_path / "a.parquet", 400)
    asked = ("batch", "a.parquet", "--maps", "room.json", "--out", "poses.parquet", "--block", "5", "--workers", "1")
    command = [sys.executable, "-c", "from cli.entry import main; main()", *asked]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    process = subprocess.Popen(command, cwd=tmp_path, env=environment)
    while process.poll() is None and not any((tmp_path / "poses.parquet.parts" / "poses").glob("*.parquet")):
        time.sleep(0.005)
    process.kill()
    process.wait()
    assert not (tmp_path / "poses.parquet").exists()
    told = linefix.done(*asked, "--json").answer
    assert (told["scans"], told["taken_over"] >= 5) == (400, True)
    assert [row["index"] for row in rows(tmp_path / "poses.parquet")] == list(range(400))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.parquet", "poses.parquet", "room.json", "scan.json"]
