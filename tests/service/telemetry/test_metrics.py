"""Metrics, the log and who reads it, and a dashboard that uses only existing metrics."""

from __future__ import annotations

import asyncio
import json
import re
import subprocess
import sys
import threading
import time
from pathlib import Path

import httpx
import orjson
import pytest

from linefix.documents import examples
from service.telemetry import metrics as module
from service.telemetry.logs import WAITING_LINES
from service.telemetry.metrics import Metrics
from tests.running import PATIENCE, RunningService, until

DASHBOARD = json.loads((Path(__file__).parents[3] / "deploy" / "grafana.json").read_text())


def asked_for() -> dict[str, str]:
    """Every expression of the dashboard, by the panel that it is in."""
    panels = DASHBOARD["panels"]
    return {f"{panel['title']} {one['refId']}": one["expr"] for panel in panels for one in panel["targets"]}


def exercise(client: httpx.Client) -> str:
    """Do everything once that is counted, and return the counts."""
    client.put("/v1/maps/seen", json=examples.MAP)
    client.post("/v1/associate", json={**examples.ASSOCIATE, "map": {"map_id": "seen"}})
    client.delete("/v1/maps/seen")
    client.get("/nothing/at/all")
    return client.get("/metrics").text


def test_the_dashboard_asks_for_what_there_is(client: httpx.Client) -> None:
    text = exercise(client)
    there = set(re.findall(r"^(linefix_\w+)", text, re.MULTILINE))
    labels = {name: set(re.findall(r'(\w+)="', line)) for name, line in re.findall(r"^(linefix_\w+)(\S*)", text, re.M)}
    assert ('route="unmatched"' in text, "/nothing/at/all" in text) == (True, False)
    assert len(asked_for()) >= 13
    for place, expression in asked_for().items():
        names = re.findall(r"linefix_\w+", expression)
        assert names, place
        assert set(names) <= there, place
        for label in re.findall(r"by \(([^)]*)\)", expression):
            assert set(label.replace(" ", "").split(",")) <= labels[names[0]], place


def test_the_dashboard_shows_all_that_is_counted(client: httpx.Client) -> None:
    families = set(re.findall(r"^# TYPE (linefix_\w+) ", exercise(client), re.MULTILINE))
    expressions = " ".join(asked_for().values())
    forgotten = {name for name in families if not name.endswith("_created") and name not in expressions}
    assert not forgotten


def test_the_log_names_request_map_and_verdict(service: RunningService) -> None:
    service.client.delete("/v1/maps/hq-3")
    stored = {**examples.ASSOCIATE, "map": {"map_id": "hq-3"}}
    stored_as = service.client.put("/v1/maps/hq-3", json=examples.MAP).json()["revision"]
    service.client.post("/v1/associate", json=stored, headers={"x-request-id": "robot-7"})
    service.client.post("/v1/associate", json=examples.ASSOCIATE, headers={"x-request-id": "inline"})
    batch = {**examples.BATCH, "map": {"map_id": "hq-3"}, "scans": [{"segments": examples.SEEN}, {}], "priors": None}
    service.client.post("/v1/associate:batch", json=batch, headers={"x-request-id": "batch"})
    service.client.post("/v1/associate", json={}, headers={"x-request-id": "wrong"})
    until(lambda: '"request_id":"wrong"' in service.log())  # a line is written after its answer is sent
    lines = [json.loads(line) for line in service.log().splitlines()]
    by_id = {line["request_id"]: line for line in lines if line["message"] == "request"}
    for line in by_id.values():
        assert {"time", "level", "method", "route", "status", "ms"} <= line.keys()
    reference = {"map_id": "hq-3", "revision": stored_as}
    told = by_id["robot-7"]
    assert (told["map"], told["verdict"], told["usable"], told["status"]) == (reference, "ok", True, 200)
    assert (by_id["inline"]["map"], by_id["inline"]["verdict"]) == (None, "ok")
    assert (by_id["batch"]["map"], by_id["batch"]["verdicts"]) == (reference, {"ok": 1, "422": 1})
    assert (by_id["wrong"]["status"], by_id["wrong"]["code"]) == (422, "invalid_request")
    assert any(line.get("route") == "/v1/maps/{map_id}" and line.get("map") == reference for line in by_id.values())


class Counted(Metrics):
    """Counts how often its text is made."""

    def __init__(self) -> None:
        super().__init__()
        self.made = 0

    def rendered(self) -> bytes:
        self.made += 1
        return super().rendered()


def test_however_many_ask_it_is_made_a_few_times_a_second() -> None:
    """Each who asked had one made, 10 ms of the event loop each."""
    counted = Counted()

    async def ask_until(made: int) -> int:
        answers = 0
        while counted.made < made:
            answers += len(await asyncio.gather(*(counted.exposition() for _ in range(50))))
        return answers

    begun = time.monotonic()
    assert asyncio.run(ask_until(5)) >= 150
    assert counted.made <= 1 + (time.monotonic() - begun) / module.EXPOSITION_SECONDS + 1


def test_it_holds_what_was_counted_before_it_was_asked_for() -> None:
    metrics = Metrics()

    async def ask() -> list[bytes]:
        texts = []
        for _ in range(3):
            metrics.cache_hits.inc()
            texts.append(await metrics.exposition())
        return texts

    for number, text in enumerate(asyncio.run(ask()), 1):
        assert b"linefix_map_cache_hits_total %d.0\n" % number in text


def test_one_that_fails_is_not_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    metrics = Metrics()

    async def ask() -> bytes:
        with monkeypatch.context() as broken:
            broken.setattr(metrics, "refresh", lambda: 1 // 0)
            for _ in range(2):
                with pytest.raises(ZeroDivisionError):
                    await metrics.exposition()
        return await metrics.exposition()

    assert b"linefix_build_info" in asyncio.run(ask())


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
