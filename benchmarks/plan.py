"""The needs of a fleet, from the cost of one request: ``python -m benchmarks plan``.

Everything is processor time, of the threads and processes that do it, so that what else the machine does counts little.
"""

from __future__ import annotations

import os
import time
import urllib.request
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import orjson
import psycopg

from association import HardPrior, MapIndex, Scan, associate
from batch.blocks import SIGMA
from examples.running import running_service
from registration import MeasuredSegments, RigidTransform, Segments
from service.database_location import database_url
from service.maps import MapStore
from service.maps.preconditions import Preconditions
from service.maps.records import MapOutline

from .growth import campus, draw_query
from .open_loop import request_of, without_pause
from .replicas import SERVER, postgresql_schema
from .table import Row, print_rows

SEGMENTS = 20_000
ROBOTS, HZ, MAPS = 10_000, 5.0, 1_000
QUERIES = 40
LOOKUPS = 2_000
SECONDS = 10.0
RADIUS, ANGLE = 1.0, 0.3  # m, rad; around where a robot believes to be
AWAY = 0.3  # m that it is wrong by, each way
USED_SHARE = 0.6  # of a core, so that a queue stays short
SEED = 20190901
LOOKING_UP = "linefix_plan"


@dataclass(frozen=True, slots=True)
class Question:
    """A scan and where it was taken."""

    pose: RigidTransform
    scan: Segments

    @property
    def prior(self) -> HardPrior:
        """The prior of a robot from a moment ago."""
        return HardPrior(RigidTransform(self.pose.x + AWAY, self.pose.y - AWAY, self.pose.theta), RADIUS, ANGLE)


def plan(quick: int) -> list[Row]:
    """Measure one map, one request and one look-up; multiply."""
    segments = campus(SEGMENTS)
    rng = np.random.default_rng(SEED)
    questions = [Question(*draw_query(segments, rng)) for _ in range(max(5, QUERIES // quick))]
    begun = time.thread_time()
    index = MapIndex.build(segments)
    index_seconds = time.thread_time() - begun
    near, anywhere = _searches(index, questions, prior=True), _searches(index, questions, prior=False)
    request_ms, sent, received = _requests(segments, questions, SECONDS / quick)
    client, server = _lookups(max(100, LOOKUPS // quick))
    rate = ROBOTS * HZ
    cores = rate * 1e-3 * request_ms / USED_SHARE
    rows = [
        Row("index of a map: processor s", f"{index_seconds:.2f}"),
        Row("index of a map: MB", f"{index.nbytes / 1e6:.1f}"),
        Row("search near a prior: processor ms, mean", f"{near:.2f}"),
        Row("search anywhere: processor ms, mean", f"{anywhere:.2f}"),
        Row("request near a prior, the whole service: processor ms", f"{request_ms:.2f}"),
        Row("request, answer: bytes", f"{sent:,.0f}, {received:,.0f}"),
        Row("look-up in PostgreSQL: processor us of the server, of the replica", f"{server:.0f}, {client:.0f}"),
        Row(f"cores of replicas at {rate:,.0f} a second, {USED_SHARE:.0%} used", f"{cores:,.0f}"),
        Row("the same without a prior", f"{cores * (request_ms - near + anywhere) / request_ms:,.0f}"),
        Row(f"memory of {MAPS:,} indexed maps, once: GB", f"{MAPS * index.nbytes / 1e9:.1f}"),
        Row("cores of the database, as many look-ups", f"{rate * 1e-6 * server / USED_SHARE:,.0f}"),
        Row("network, in and out: Gbit/s", f"{8e-9 * rate * sent:.2f}, {8e-9 * rate * received:.2f}"),
    ]
    print_rows(f"{ROBOTS:,} robots at {HZ:g} Hz on {MAPS:,} maps of {SEGMENTS:,} segments", rows)
    return rows


def _searches(index: MapIndex, questions: Sequence[Question], *, prior: bool) -> float:
    """Return the mean of the processor milliseconds of searches."""
    times = []
    for again in (False, True):
        for question in questions:
            scan = Scan(MeasuredSegments.from_segments(question.scan, SIGMA))
            begun = time.thread_time()
            associate(index, scan, question.prior if prior else None)
            times += [time.thread_time() - begun] if again else []
    return 1e3 * float(np.mean(times))


def _requests(segments: Segments, questions: Sequence[Question], seconds: float) -> tuple[float, float, float]:
    """Return processor milliseconds of a request, its bytes and those of its answer."""
    bodies = []
    for question in questions:
        prior = {"x": question.prior.pose.x, "y": question.prior.pose.y, "theta": question.prior.pose.theta}
        scan = {"segments": np.round(question.scan.endpoints, 3)}
        asked = {"map": {"map_id": "m"}, "scan": scan, "prior": {**prior, "radius": RADIUS, "angle": ANGLE}}
        asked["options"] = {"include": [], "max_alternatives": 0}
        bodies.append(orjson.dumps(asked, option=orjson.OPT_SERIALIZE_NUMPY))
    with postgresql_schema() as database, running_service(database_url=database, searches=1) as (url, pid):
        _ask(url, "PUT", "/v1/maps/m", orjson.dumps({"segments": segments.endpoints.tolist()}))
        answers = [len(_ask(url, "POST", "/v1/associate", body)) for body in bodies]
        port, requests = int(url.rsplit(":", 1)[1]), [request_of("/v1/associate", body) for body in bodies]
        used = _processor_seconds(pid)
        found = without_pause(port, requests, 2, seconds)
        spent = _processor_seconds(pid) - used
    return 1e3 * spent / len(found), float(np.mean([len(r) for r in requests])), float(np.mean(answers))


def _ask(url: str, method: str, path: str, body: bytes) -> bytes:
    request = urllib.request.Request(url + path, body, {"Content-Type": "application/json"}, method=method)
    with urllib.request.urlopen(request, timeout=120) as answer:
        content: bytes = answer.read()
        return content


def _lookups(count: int) -> tuple[float, float]:
    """Return the processor microseconds of a look-up: of the client, and of the server."""
    with postgresql_schema() as database:
        store = MapStore(database_url(f"{database}&application_name={LOOKING_UP}"))
        store.open()
        store.put("m", b"{}", MapOutline(1, (0.0, 0.0, 1.0, 1.0)), Preconditions())
        store.record("m")
        backends = _backends()
        before, begun = sum(_processor_seconds(pid) for pid in backends), time.thread_time()
        for _ in range(count):
            store.record("m")
        mine = time.thread_time() - begun
        theirs = sum(_processor_seconds(pid) for pid in backends) - before
        store.close()
    return 1e6 * mine / count, 1e6 * theirs / count


def _backends() -> list[int]:
    """Return the processes of the server that look up."""
    with psycopg.connect(SERVER) as connection:
        asked = "SELECT pid FROM pg_stat_activity WHERE application_name = %s"
        return [pid for (pid,) in connection.execute(asked, (LOOKING_UP,)).fetchall()]


def _processor_seconds(pid: int) -> float:
    """Return what a process and its children have used so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    own = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    tasks = Path(f"/proc/{pid}/task").iterdir()
    children = [child for task in tasks for child in (task / "children").read_text().split()]
    return own + sum(_processor_seconds(int(child)) for child in children)
