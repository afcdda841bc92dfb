"""Ray: a cluster of two nodes, one of which is lost on the way."""

from __future__ import annotations

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.batch.logs import rows, write_log, write_room

# In a process of its own: Ray warns, leaves threads behind and takes over signals.
SCRIPT = """
import logging, os, sys
# Its own agents take long to start on a machine that does much else, and it gives them up after 30 s.
os.environ |= {"RAY_agent_register_timeout_ms": "300000", "RAY_raylet_start_wait_time_s": "300"}
os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
import ray
from ray.cluster_utils import Cluster
from batch import FleetOptions, OnRay, associate_many

log, room, out = sys.argv[1:]
cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
second = cluster.add_node(num_cpus=1)
ray.init(address=cluster.address, logging_level=logging.ERROR)
lost = []

def lose_one(stage, done, total):
    if stage == "searching" and done > 0 and not lost:
        lost.append(done)
        cluster.remove_node(second, allow_graceful=False)

summary = associate_many([log], room, out, FleetOptions(block=20), OnRay(), lose_one)
nodes = [node["Alive"] for node in ray.nodes()]
print("told", summary.scans, summary.errors, len(lost), sorted(nodes))
ray.shutdown()
cluster.shutdown()
"""


@pytest.mark.long
@pytest.mark.skipif(find_spec("ray") is None, reason="needs Ray")
def test_a_lost_node_costs_no_row(tmp_path: Path) -> None:
    log, room, out = write_log(tmp_path / "a.parquet", 400), write_room(tmp_path), tmp_path / "out.parquet"
    command = [sys.executable, "-c", SCRIPT, str(log), str(room), str(out)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=580, check=False)
    told = [line for line in ended.stdout.splitlines() if line.startswith("told")]
    assert told == ["told 400 0 1 [False, True]"], ended.stderr[-3000:]
    assert [row["index"] for row in rows(out)] == list(range(400))
