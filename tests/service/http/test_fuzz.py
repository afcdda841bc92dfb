"""Requests that no one would think of. Made from the schema, from structured JSON and from raw bytes: each finds what
the others miss."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import orjson
import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from schemathesis import GenerationMode, checks

from linefix.documents import examples
from tests.running import RunningService, running
from tests.service.importing.forms import SQUARE, TYPE, form, room_grid

CASES = int(os.environ.get("FUZZ_CASES", "300"))
PATHS = ["/v1/register", "/v1/associate", "/v1/associate:batch", "/v1/vectorize"]
HELD = [
    *(checks.status_code_conformance, checks.content_type_conformance),
    *(checks.response_schema_conformance, checks.response_headers_conformance),
]
LONGEST = 60.0  # s; an analysis may take half a minute, its deadline by default
GROWTH = 32e6  # bytes that requests may leave behind


def fuzz(share: float) -> settings:
    """Give a test its share of the cases; the same ones every time, unless there are many."""
    return settings(
        max_examples=max(3, round(share * CASES)),
        deadline=None,
        suppress_health_check=list(HealthCheck),
        phases=[Phase.explicit, Phase.generate],
        derandomize=CASES <= 1000,
        database=None,
        print_blob=True,
    )


@pytest.fixture(scope="module")
def fuzzed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningService]:
    """A service that keeps next to no maps, so that its memory shows what requests leave behind."""
    with running(tmp_path_factory.mktemp("fuzzed"), cache_bytes=1_000_000) as service:
        yield service
        assert service.process.poll() is None
        assert "Traceback" not in service.log()


def resident(service: RunningService) -> int:
    return int(Path(f"/proc/{service.process.pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.fixture(scope="module")
def client(fuzzed: RunningService) -> httpx.Client:
    return fuzzed.client


CALLS = [
    *("POST /v1/register", "POST /v1/associate", "POST /v1/associate:batch", "POST /v1/vectorize", "GET /v1/limits"),
    *("PUT /v1/maps/{map_id}", "GET /v1/maps/{map_id}", "DELETE /v1/maps/{map_id}", "GET /v1/maps", "GET /livez"),
    *("GET /v1/maps/{map_id}:check", "POST /v1/maps/{map_id}:check", "POST /v1/maps/{map_id}:analyze", "GET /version"),
    *("POST /v1/analyze", "POST /v1/maps/{map_id}:update", "POST /v1/maps:apply", "GET /readyz"),
]


@pytest.fixture(scope="module")
def schema(fuzzed: RunningService) -> Any:
    return schemathesis.openapi.from_url(fuzzed.url + "/openapi.json")


@pytest.mark.parametrize("mode", [GenerationMode.POSITIVE, GenerationMode.NEGATIVE], ids=str)
@pytest.mark.parametrize("call", CALLS)
def test_the_schema_holds(schema: Any, call: str, mode: GenerationMode) -> None:
    method, path = call.split()
    if mode is GenerationMode.NEGATIVE and path in ("/v1/limits", "/version", "/livez", "/readyz"):
        return  # nothing there that could be sent wrongly

    @fuzz(0.01 if path in PATHS else 0.002 if not path.startswith("/v1/maps") else 0.02)
    @given(case=schema[path][method].as_strategy(generation_mode=mode))
    def one(case: schemathesis.Case) -> None:
        response = case.call(timeout=LONGEST)
        # A deadline may be asked for that is over at once.
        assert response.status_code < 500 or response.status_code == 504, response.text
        assert response.status_code < 400 or len(response.content) <= 8192
        case.validate_response(response, checks=HELD)

    one()


def assert_sane(response: httpx.Response) -> None:
    assert response.status_code < 500 or response.status_code in (503, 504), response.text
    if response.status_code >= 400:
        assert len(response.content) <= 8192
        assert response.headers["content-type"] == "application/problem+json"
    # orjson refuses NaN and infinity.
    orjson.loads(response.content)


ODD = [0, -0.0, 5e-324, 1e-6, 1e9, 1e308, 2**53, 2**63, 2**64, 10**400, math.pi, "1.5", "NaN", "\x00", "\ud7ff"]
LEAVES = st.none() | st.booleans() | st.integers() | st.sampled_from(ODD) | st.floats() | st.text(max_size=5)
ANYTHING = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=8,
)
BODIES = {
    "/v1/register": examples.REGISTER,
    "/v1/associate": examples.ASSOCIATE,
    "/v1/associate:batch": examples.BATCH,
    "/v1/vectorize": examples.VECTORIZE,
}


@st.composite
def mutated(draw: st.DrawFn, path: str) -> Any:
    """A request that is right but for one to three places."""
    body = orjson.loads(orjson.dumps(BODIES[path]))
    for _ in range(draw(st.integers(1, 3))):
        place: Any = body
        while isinstance(place, dict | list) and place:
            key = draw(st.sampled_from(sorted(place) if isinstance(place, dict) else [*range(len(place))]))
            if isinstance(place[key], dict | list) and draw(st.integers(0, 3)):
                place = place[key]
                continue
            if draw(st.booleans()):
                place[key] = draw(ANYTHING)
            else:
                del place[key]
            break
    return body


def encoded(body: Any) -> bytes:
    return json.dumps(body, ensure_ascii=True).encode()  # NaN and Infinity go out as they are


@pytest.mark.parametrize("path", PATHS)
@fuzz(0.08)
@given(data=st.data())
def test_mutated_requests(client: httpx.Client, path: str, data: st.DataObject) -> None:
    assert_sane(client.post(path, content=encoded(data.draw(mutated(path)))))


@pytest.mark.parametrize("path", PATHS)
@fuzz(0.04)
@given(body=st.one_of(st.binary(max_size=200), ANYTHING.map(encoded)))
def test_bytes_and_json_of_any_kind(client: httpx.Client, path: str, body: bytes) -> None:
    assert_sane(client.post(path, content=body))


SCALES = st.sampled_from([1e-6, 1e-3, 1.0, 1e3, 1e4 / 2**0.5, 1e4])
ORIGINS = st.sampled_from([0.0, 5e6, -1e9 + 1e5, 1e9 - 1e5])
PLACES = st.sampled_from([0.0, 0.0, 1.0, 5e4, -5e4, 1e5])
SIGMAS = st.sampled_from([0.0, 1e-12, 0.02, 10.0])


@st.composite
def extreme_segments(draw: st.DrawFn) -> list[list[float]]:
    """Segments at the limits of the contract: tiny, long, far out, far apart, on top of each other."""
    origin, rows = [draw(ORIGINS), draw(ORIGINS)], []
    for _ in range(draw(st.integers(1, 6))):
        scale, (x, y) = draw(SCALES), [one + draw(PLACES) for one in origin]
        a, b, c, d = (draw(st.integers(-4, 4)) / 4 * scale for _ in range(4))
        rows.append([x + a, y + b, x + c, y + d])
    return rows


def any_of(**values: list[Any]) -> st.SearchStrategy[dict[str, Any]]:
    return st.fixed_dictionaries({name: st.sampled_from(some) for name, some in values.items()})


FAR = [0.0, 1e9, -1e9]
EXTREME_PRIORS = st.none() | any_of(
    x=FAR, y=[0.0, 5e6], theta=[*FAR, math.pi], radius=[0.0, 1e-9, 1.0, 1e9], angle=[0.0, 1e-9, math.tau, 1e9]
)


@fuzz(0.14)
@given(data=st.data())
def test_extreme_geometry(client: httpx.Client, data: st.DataObject) -> None:
    on, seen = data.draw(extreme_segments()), data.draw(extreme_segments())
    sigma, options = data.draw(SIGMAS), {"oriented": data.draw(st.booleans())}
    body = {"map": {"segments": on, "sigma": sigma}, "scan": {"segments": seen, "sigma": sigma}, "options": options}
    assert_sane(client.post("/v1/associate", json={**body, "prior": data.draw(EXTREME_PRIORS)}))
    pairs = [[i, min(i, len(on) - 1)] for i in range(len(seen))]
    for estimator in ("joint", "one_step"):
        known = {**body, "correspondences": pairs, "options": {**options, "estimator": estimator}}
        assert_sane(client.post("/v1/register", json=known))


RANGES = st.lists(st.none() | st.sampled_from([0.0, 1e-9, 0.1, 1.0, 1.0, 1.0, 30.0, 1e4, 1e9, -1.0]), max_size=60)
EXTREME_LASERS = any_of(
    angle_min=[*FAR, -math.pi], angle_increment=[1e-12, 1e-4, 0.01, math.tau / 60, -0.1, 1.0, -1.0],
    range_min=[0.0, 0.1, 1.0], range_max=[1.0, 30.0, 1e9],
)  # fmt: skip


@fuzz(0.14)
@given(laser=EXTREME_LASERS, ranges=RANGES, sigma=st.none() | SIGMAS, on=extreme_segments())
def test_extreme_scans(client: httpx.Client, laser: Any, ranges: list[float | None], sigma: Any, on: Any) -> None:
    laser = {**laser, "ranges": ranges}
    points = [[r or 0.0, float(i)] for i, r in enumerate(ranges)]
    for scan in ({"laser": laser}, {"points": points}):
        assert_sane(client.post("/v1/vectorize", json={**scan, "options": {"sigma": sigma}}))
    assert_sane(client.post("/v1/associate", json={"map": {"segments": on}, "scan": {"laser": laser, "sigma": sigma}}))


SVG = b'<svg xmlns="http://www.w3.org/2000/svg" width="9"><path d="M0 0h8v5h-8z"/><rect width="2" height="1"/></svg>'
GEOJSON = b'{"type": "LineString", "coordinates": [[0.0, 0.0], [8.0, 0.0], [8.0, 5.0], [0.0, 5.0]]}'
DXF = b"0\nSECTION\n2\nENTITIES\n0\nLINE\n8\nWALL\n10\n0.0\n20\n0.0\n11\n8.0\n21\n0.0\n0\nENDSEC\n0\nEOF\n"
FILES = [{"plan.svg": SVG}, {"plan.geojson": GEOJSON}, {"plan.dxf": DXF}, {"plan.csv": SQUARE}, room_grid()]
TOKENS = st.sampled_from([b"", b"0", b"-", b"1e999", b"nan", b"9" * 30, b"\n", b"\xff", b"<", b"[", b'"', b"\x00" * 9])


@st.composite
def mutated_files(draw: st.DrawFn) -> dict[str, bytes]:
    """Files of a map that are right but for up to three places in one of them, and perhaps in another's name."""
    files = dict(draw(st.sampled_from(FILES)))
    name = draw(st.sampled_from(sorted(files)))
    for _ in range(draw(st.integers(0, 3))):
        content = files[name]
        begin = draw(st.integers(0, len(content)))
        end = draw(st.sampled_from([begin, begin + 1, begin + 4, len(content)]))
        files[name] = content[:begin] + draw(TOKENS | st.binary(max_size=8)) + content[end:]
    if draw(st.integers(0, 5)) == 0:
        files[draw(st.sampled_from(["map.png", "map.yaml", "map.zip", "map", "a.db3", "../map.svg"]))] = files.pop(name)
    return files


@pytest.mark.long
@fuzz(0.003)
@given(files=mutated_files(), options=st.none() | st.binary(max_size=30) | ANYTHING.map(encoded))
def test_mutated_files_of_other_tools(client: httpx.Client, files: dict[str, bytes], options: bytes | None) -> None:
    fields = [] if options is None else [("options", options.decode("latin-1"))]
    assert_sane(client.post("/v1/maps:import", content=bytes(form(files, *fields)), headers={"content-type": TYPE}))


def test_memory_stays_flat(fuzzed: RunningService, client: httpx.Client) -> None:
    """The same again after everything else: what the requests took has been given back."""
    bodies = [orjson.dumps(BODIES[path]) for path in PATHS] + [b"[" * 100_000, b"\xff" * 100_000]
    before = resident(fuzzed)
    for number in range(max(200, CASES // 20)):
        assert_sane(client.post(PATHS[number % 4], content=bodies[number % len(bodies)]))
    print(f"memory after {CASES} cases: {resident(fuzzed) / 1e6:.0f} MB")
    assert resident(fuzzed) - before < GROWTH
    assert resident(fuzzed) < 512e6
