"""The log, and who reads it."""

from __future__ import annotations

import subprocess
import sys
import threading

import orjson

from service.telemetry.logs import WAITING_LINES
from tests.running import PATIENCE

LOGS = """
import logging, logging.config, sys, time
from service.telemetry.logs import log_config
logging.config.dictConfig(log_config("info"))
begun = time.monotonic()
for number in range({count}):
    logging.getLogger("linefix").info("line", extra={{"number": number, "text": "x" * 100}})
took = time.monotonic() - begun
print(took, flush=True)
time.sleep({rest})
logging.getLogger("linefix").info("last")
"""


def test_lines_come_in_order_and_whole() -> None:
    code = LOGS.format(count=3000, rest=0)
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stderr.splitlines()
    lines = [orjson.loads(line) for line in told]
    assert [line["number"] for line in lines[:-1]] == list(range(3000))
    assert lines[-1]["message"] == "last"


def test_what_a_sleeping_reader_misses_is_counted() -> None:
    count = WAITING_LINES + 5000
    code = LOGS.format(count=count, rest=2)
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        ending = threading.Timer(PATIENCE, process.kill)
        ending.start()
        assert process.stdout.readline(), "stood still"  # the log is not read meanwhile
        ending.cancel()
        lines = [orjson.loads(line) for line in process.stderr.read().splitlines()]
    lost = sum(line.get("count", 0) for line in lines)
    assert lost > 0
    assert sum(line["message"] == "line" for line in lines) + lost == count
    assert lines[-1]["message"] == "last"
