"""Requests that nobody would think of. Made from the schema, from structured JSON and from raw bytes: each finds what
the others miss."""

from __future__ import annotations

import math
import os
from typing import Any

import httpx
import orjson
import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from schemathesis import GenerationMode, checks

from service.schemas import examples

CASES = int(os.environ.get("FUZZ_CASES", "20"))
LONG_CASES = int(os.environ.get("FUZZ_LONG_CASES", "3000"))
PATHS = ["/v1/register", "/v1/associate", "/v1/associate:batch", "/v1/vectorize"]
HELD = [
    checks.status_code_conformance,
    checks.content_type_conformance,
    checks.response_schema_conformance,
    checks.response_headers_conformance,
]
FUZZ = {
    "deadline": None,
    "suppress_health_check": list(HealthCheck),
    "phases": [Phase.explicit, Phase.generate],
    "derandomize": True,
    "database": None,
}


OPERATIONS = [
    ("POST", "/v1/register"),
    ("POST", "/v1/associate"),
    ("POST", "/v1/associate:batch"),
    ("POST", "/v1/vectorize"),
    ("PUT", "/v1/maps/{map_id}"),
    ("GET", "/v1/maps/{map_id}"),
    ("DELETE", "/v1/maps/{map_id}"),
    ("GET", "/v1/maps"),
    ("GET", "/v1/limits"),
    ("GET", "/version"),
    ("GET", "/livez"),
    ("GET", "/readyz"),
]
MODES = [GenerationMode.POSITIVE, GenerationMode.NEGATIVE]
IDS = [" ".join(operation) for operation in OPERATIONS]


@pytest.fixture(scope="module")
def schema(service: Any) -> Any:
    return schemathesis.openapi.from_url(service.url + "/openapi.json")


def hold_to_the_schema(schema: Any, operation: tuple[str, str], mode: GenerationMode, cases: int) -> None:
    method, path = operation

    @settings(max_examples=cases, **FUZZ)
    @given(case=schema[path][method].as_strategy(generation_mode=mode))
    def one(case: schemathesis.Case) -> None:
        response = case.call()
        # A deadline may be asked for that is over at once.
        assert response.status_code < 500 or response.status_code == 504, response.text
        case.validate_response(response, checks=HELD)

    one()


@pytest.mark.parametrize("mode", MODES, ids=str)
@pytest.mark.parametrize("operation", OPERATIONS, ids=IDS)
def test_the_schema_holds(schema: Any, operation: tuple[str, str], mode: GenerationMode) -> None:
    if mode is GenerationMode.NEGATIVE and operation[1] in ("/v1/limits", "/version", "/livez", "/readyz"):
        return  # nothing there that could be sent wrongly
    hold_to_the_schema(schema, operation, mode, CASES)


@pytest.mark.long
@pytest.mark.parametrize("mode", MODES, ids=str)
@pytest.mark.parametrize("operation", OPERATIONS[:8], ids=IDS[:8])
def test_the_schema_holds_for_long(schema: Any, operation: tuple[str, str], mode: GenerationMode) -> None:
    hold_to_the_schema(schema, operation, mode, LONG_CASES)


def assert_sane(response: httpx.Response) -> None:
    assert response.status_code < 500 or response.status_code in (503, 504), response.text
    if response.status_code >= 400:
        assert len(response.content) <= 8192
        assert response.headers["content-type"] == "application/problem+json"
    # orjson refuses NaN and infinity.
    orjson.loads(response.content)


LEAVES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.sampled_from(
        [0, -0.0, 5e-324, 1e-6, 1e9, 1e308, 2**53, 2**63, 2**64, 10**400, math.pi, "1.5", "NaN", "\x00", "\ud7ff"]
    ),
    st.floats(),
    st.text(max_size=5),
)
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
        while True:
            if not isinstance(place, dict | list) or not place:
                break
            keys = sorted(place) if isinstance(place, dict) else range(len(place))
            key = draw(st.sampled_from(list(keys)))
            if not isinstance(place[key], dict | list) or draw(st.integers(0, 3)) == 0:
                if draw(st.booleans()):
                    place[key] = draw(ANYTHING)
                else:
                    del place[key]
                break
            place = place[key]
    return body


def encoded(body: Any) -> bytes:
    import json

    return json.dumps(body, ensure_ascii=True).encode()  # NaN and Infinity go out as they are


@pytest.mark.parametrize("path", PATHS)
@settings(max_examples=4 * CASES, **FUZZ)
@given(data=st.data())
def test_mutated_requests(client: httpx.Client, path: str, data: st.DataObject) -> None:
    assert_sane(client.post(path, content=encoded(data.draw(mutated(path)))))


@pytest.mark.parametrize("path", PATHS)
@settings(max_examples=2 * CASES, **FUZZ)
@given(body=st.one_of(st.binary(max_size=200), ANYTHING.map(encoded)))
def test_bytes_and_json_of_any_kind(client: httpx.Client, path: str, body: bytes) -> None:
    assert_sane(client.post(path, content=body))


SCALES = st.sampled_from([1e-6, 1e-3, 1.0, 1e3, 9.9e3])
ORIGINS = st.sampled_from([0.0, 5e6, -1e9 + 1e5, 9.99e8])


@st.composite
def extreme_segments(draw: st.DrawFn) -> list[list[float]]:
    """Segments at the limits of the contract: tiny, long, far out, on top of each other."""
    x, y = draw(ORIGINS), draw(ORIGINS)
    rows = []
    for _ in range(draw(st.integers(1, 6))):
        scale = draw(SCALES)
        numbers = [draw(st.integers(-4, 4)) / 4 * scale for _ in range(4)]
        rows.append([x + numbers[0], y + numbers[1], x + numbers[2], y + numbers[3]])
    return rows


@settings(max_examples=6 * CASES, **FUZZ)
@given(
    on=extreme_segments(),
    seen=extreme_segments(),
    sigma=st.sampled_from([0.0, 1e-12, 0.02, 10.0]),
    oriented=st.booleans(),
)
def test_extreme_geometry(client: httpx.Client, on: Any, seen: Any, sigma: float, oriented: bool) -> None:
    options = {"oriented": oriented}
    body = {"map": {"segments": on, "sigma": sigma}, "scan": {"segments": seen, "sigma": sigma}, "options": options}
    assert_sane(client.post("/v1/associate", json=body))
    pairs = [[i, min(i, len(on) - 1)] for i in range(len(seen))]
    for estimator in ("joint", "one_step"):
        known = {**body, "correspondences": pairs, "options": {**options, "estimator": estimator}}
        assert_sane(client.post("/v1/register", json=known))


@pytest.mark.long
@pytest.mark.parametrize("path", PATHS)
@settings(max_examples=LONG_CASES, **{**FUZZ, "derandomize": False})
@given(data=st.data())
def test_mutated_requests_for_long(client: httpx.Client, path: str, data: st.DataObject) -> None:
    assert_sane(client.post(path, content=encoded(data.draw(mutated(path)))))
