"""Recordings that tests fill."""

from __future__ import annotations

from pathlib import Path

import pytest

from .bags import Recording, Robots


@pytest.fixture
def bag(tmp_path: Path) -> Robots:
    """The folder of a bag of ROS 2, with an mcap."""
    return Robots("mcap", tmp_path)


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    """An mcap alone."""
    return Recording(tmp_path / "a.mcap")
