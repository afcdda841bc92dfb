"""The log, and who reads it."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import threading
from pathlib import Path

import orjson
import pytest

from examples.running import free_port
from service.telemetry.logs import WAITING_LINES
from tests.running import PATIENCE, START_SECONDS, answers, client_of, until

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


def ask_for_livez(port: int, times: int) -> None:
    """Ask so many times over one connection, a hundred times at once."""
    request = b"GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n"
    with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) as connection:
        for _ in range(times // 100):
            connection.sendall(request * 100)
            answers = b""
            while answers.count(b'{"status":"ok"}') < 100:
                part = connection.recv(65_536)
                assert part, answers
                answers += part


@pytest.mark.long
def test_the_service_does_not_wait_for_who_reads_its_log(tmp_path: Path) -> None:
    """A pipe holds 64 kB; with the next line the event loop stood still."""
    port = free_port()
    reading, writing = os.pipe()
    arguments = ["--port", str(port), "--data-dir", str(tmp_path), "--drain-s", "0"]
    process = subprocess.Popen([sys.executable, "-m", "service", *arguments], stderr=writing)
    os.close(writing)
    try:
        with client_of(f"http://127.0.0.1:{port}") as client:
            until(lambda: answers(client, "/readyz"), START_SECONDS)
        ask_for_livez(port, WAITING_LINES + 1000)
        process.terminate()
        assert process.wait(15) == 0
    finally:
        process.kill()
        process.wait()
        os.close(reading)
