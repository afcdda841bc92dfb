"""What the tests of the bridge share."""

from __future__ import annotations

from pathlib import Path

import pytest

import linefix

from .robot import LOOPBACK, ROOM


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch, worker_id: str) -> int:
    number = 100 + int(worker_id.removeprefix("gw") or 0) if worker_id != "master" else 100
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(number))
    return number


@pytest.fixture
def map_file(tmp_path: Path) -> str:
    file = tmp_path / "room.json"
    linefix.write_map(linefix.LineMap(linefix.Segments.from_array(ROOM)), file)
    return str(file)


@pytest.fixture(scope="session")
def room() -> linefix.MapIndex:
    return linefix.index_map(ROOM)
