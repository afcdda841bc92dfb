"""Bags in a batch: scanners that are upside down or upright, and robots that move while they scan."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from batch import associate_many
from tests.cli.test_replay_bags import BEAMS, MOUNT, ROOM, SECONDS, STEP, TWIST, put_scan, robots, swept, write_drive
from tests.formats.bags import SECOND, Robots

from .logs import rows
from .test_running import SMALL, Here


@pytest.mark.parametrize("odometry", [True, False])
def test_the_motion_during_scans_counts(tmp_path: Path, odometry: bool) -> None:
    write_drive(tmp_path, odometry=odometry)
    told = associate_many([tmp_path / "robot_mcap"], tmp_path / "room.json", tmp_path / "out.parquet", SMALL, Here())
    assert ("motion" in [note.code for note in told.notes]) is not odometry
    found = rows(tmp_path / "out.parquet")
    for row, robot in zip(found, robots(), strict=True):
        sensor, sigma = robot.compose(MOUNT), math.sqrt(row["covariance"][8])
        wrong = abs(math.remainder(row["theta"] - sensor.theta, math.tau))
        assert row["usable"]
        assert wrong < 2.0 * sigma or wrong < 0.01
        assert (math.sqrt(row["covariance"][0]) > 0.25 * SECONDS * 0.9) is not odometry


@pytest.mark.parametrize("flipped", [False, True])
def test_a_parquet_file_may_have_the_motion_too(tmp_path: Path, flipped: bool) -> None:
    (tmp_path / "room.json").write_text(json.dumps({"segments": ROOM}))
    robot, still = robots()[1], type(MOUNT)(0.0, 0.0, 0.0)
    ranges = swept(ROOM, robot, still, moving=True, seed=2).astype(float)
    side = -1.0 if flipped else 1.0
    columns = {
        "angle_min": [side * -math.pi],
        "angle_increment": [side * STEP],
        "ranges": [ranges.tolist()],
        "flipped": [flipped],
        "time_increment": [SECONDS / BEAMS],
        "vx": [TWIST[0]],
        "vy": [side * TWIST[1]],
        "omega": [side * TWIST[2]],
    }
    pq.write_table(pa.table(columns), tmp_path / "a.parquet")
    associate_many([tmp_path / "a.parquet"], tmp_path / "room.json", tmp_path / "out.parquet", SMALL, Here())
    (row,) = rows(tmp_path / "out.parquet")
    assert row["usable"]
    assert math.hypot(row["x"] - robot.x, row["y"] - robot.y) < 0.02
    assert row["theta"] == pytest.approx(robot.theta, abs=0.006)


def test_upright_scans_have_rows_that_say_so(tmp_path: Path) -> None:
    (tmp_path / "room.json").write_text(json.dumps({"segments": ROOM}))
    bag = Robots("mcap", tmp_path)
    bag.transform("/tf_static", 0, "base_link", "camera_optical", turn=(-0.5, 0.5, -0.5, 0.5))
    bag.transform("/tf_static", 0, "base_link", "laser")
    ranges = swept(ROOM, robots()[0], MOUNT, moving=False, seed=1)
    for k, frame in enumerate(("laser", "camera_optical")):
        put_scan(bag, (k + 1) * SECOND, np.asarray(ranges), frame)
    associate_many([bag.done()], tmp_path / "room.json", tmp_path / "out.parquet", SMALL, Here())
    good, bad = rows(tmp_path / "out.parquet")
    assert good["usable"]
    assert not bad["usable"]
    assert "camera_optical: the scan plane is 90.0 degrees from horizontal" in bad["error"]
