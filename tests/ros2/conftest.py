"""Fixtures of the tests of the bridge."""

from __future__ import annotations

import fcntl
import gc
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from cyclonedds.domain import DomainParticipant

import linefix
from ros2.messages import String
from ros2.topics import LATCHED, Publisher

from .robot import LOOPBACK, ROOM


@pytest.fixture(scope="session")
def free_domain() -> Iterator[int]:
    """A domain that no other run of these tests on this computer uses: a lock on its file, which ends with a run."""
    for number in (100 + (os.getpid() + k) % 50 for k in range(50)):
        with open(Path(tempfile.gettempdir()) / f"linefix-tests-{os.getuid()}-domain-{number}", "w") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            yield number
            return
    pytest.fail("all 50 DDS domains of these tests are in use; wait for other runs")


@pytest.fixture(scope="session")
def first_sample(free_domain: int) -> Publisher[Any]:
    """A sample that stays until the end.

    Cyclone DDS compares each sample with the first one that it stores, of whatever type, and reads the type of that
    one, which is freed with its last topic: a robot that has gone would take it along.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CYCLONEDDS_URI", LOOPBACK)
        publisher = Publisher(DomainParticipant(free_domain), "first", String, LATCHED)
    publisher.publish(String())
    return publisher


@pytest.fixture
def domain(free_domain: int, first_sample: Publisher[Any], monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    number = free_domain
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
