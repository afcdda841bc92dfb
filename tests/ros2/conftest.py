"""Fixtures of the tests of the bridge."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

import linefix

from .robot import LOOPBACK, ROOM


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    number = 100 + os.getpid() % 50  # others may run these tests at the same time
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(number))
    yield number
    gc.collect()  # participants that are not yet deleted would take part in the next test


@pytest.fixture
def map_file(tmp_path: Path) -> str:
    file = tmp_path / "room.json"
    linefix.write_map(linefix.LineMap(linefix.Segments.from_array(ROOM)), file)
    return str(file)


@pytest.fixture(scope="session")
def room() -> linefix.MapIndex:
    return linefix.index_map(ROOM)
