"""The contract's own document."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any, get_args

import httpx
import pytest

from association import ReasonCode, Status, WarningCode
from linefix.documents import examples
from map_quality import FindingCode
from service.http.problems import KINDS


@pytest.fixture(scope="module")
def document(service: Any) -> dict[str, Any]:
    return httpx.get(service.url + "/openapi.json").json()


def operations(document: dict[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    for path, item in document["paths"].items():
        for method, operation in item.items():
            yield method.upper(), path, operation


def test_operations_have_short_names(document: dict[str, Any]) -> None:
    """Generated clients name their functions so."""
    names = [operation["operationId"] for _, _, operation in operations(document)]
    assert len(set(names)) == len(names)
    assert all(re.fullmatch("[a-z]+(_[a-z]+){0,3}", name) and len(name) <= 24 for name in names), names
    assert not any(name.startswith(("get_v", "post_", "put_v", "delete_v")) for name in names), names
    assert {"associate", "associate_batch", "register", "vectorize", "put_map", "list_maps", "check_map"} <= {*names}


def test_every_error_is_a_problem(document: dict[str, Any]) -> None:
    for method, path, operation in operations(document):
        (content,) = operation["responses"]["default"]["content"].items()
        assert content == ("application/problem+json", {"schema": {"$ref": "#/components/schemas/Problem"}})
        others = operation["responses"].keys() - {"default"}
        assert max(map(int, others)) < 400, (method, path)


def test_every_example_is_answered(document: dict[str, Any], client: httpx.Client) -> None:
    tried = 0
    for method, path, operation in operations(document):
        content = operation.get("requestBody", {}).get("content", {})
        for example in content.get("application/json", {}).get("examples", {}).values():
            url = path.replace("{map_id}", "hq-3")
            status = client.request(method, url, json=example["value"]).status_code
            stored = example["value"].get("map", {}).get("map_id") or path.endswith((":check", ":analyze", ":update"))
            assert status in ((404,) if stored else (200, 201)), (path, status)
            client.delete("/v1/maps/hq-3")
            tried += 1
    assert tried >= 6


def parts_of(schema: dict[str, Any]) -> Iterator[dict[str, Any]]:
    yield schema
    for one in schema.get("anyOf", []):
        yield from parts_of(one)


@pytest.mark.parametrize("model", ["SearchOptions", "HardPriorFields"])
def test_the_document_allows_what_the_service_takes_and_no_more(
    document: dict[str, Any], client: httpx.Client, model: str
) -> None:
    """That the bounds themselves stay as they are is a matter of tests/service/http/test_contract.py."""

    def status(name: str, value: float) -> int:
        prior = {"x": 1.0, "y": 0.5, "theta": 1.5, "radius": 3.0, "angle": 1.0, name: value}
        parts = {"options": {name: value}} if model == "SearchOptions" else {"prior": prior}
        return client.post("/v1/associate", json={**examples.ASSOCIATE, **parts}).status_code

    fields = document["components"]["schemas"][model]["properties"]
    bounded = [(name, one) for name, field in fields.items() for one in parts_of(field) if "maximum" in one]
    assert len(bounded) >= 5
    for name, bounds in bounded:
        low, beyond = bounds.get("minimum", bounds.get("exclusiveMinimum")), 1 if bounds["type"] == "integer" else 1e-3
        assert name == "deadline_ms" or status(name, low) == (422 if "exclusiveMinimum" in bounds else 200), name
        found = [status(name, value) for value in (low - beyond, bounds["maximum"], bounds["maximum"] + beyond)]
        assert found == [422, 200, 422], name


def test_weights_are_taken_as_the_document_says(document: dict[str, Any], client: httpx.Client) -> None:
    weights = document["components"]["schemas"]["RegisterRequest"]["properties"]["weights"]
    (item,) = (part["items"] for part in parts_of(weights) if part.get("type") == "array")
    zero, some = item["anyOf"]
    assert zero == {"const": 0}
    for weight, status in ((0, 200), (some["minimum"], 200), (1.0, 200), (some["maximum"], 200), (1e-101, 422)):
        answer = client.post("/v1/register", json={**examples.REGISTER, "weights": [1.0, weight]})
        assert answer.status_code == status, weight
        if status == 422:
            assert answer.json()["errors"][0]["pointer"] == "/weights/1"


def test_padlocks_are_on_what_asks_for_a_key(document: dict[str, Any], guarded: Any) -> None:
    """What is open has none; of a service without keys that is everything."""
    assert "security" not in document
    assert not any("security" in operation for _, _, operation in operations(document))
    locked = httpx.get(guarded.url + "/openapi.json").json()
    assert "security" not in locked
    for method, path, operation in operations(locked):
        assert operation.get("security") == ([{"key": []}] if path.startswith("/v1/") else None), (method, path)
    assert locked["components"]["securitySchemes"] == {"key": {"type": "http", "scheme": "bearer"}}


def reached(document: dict[str, Any], schema: dict[str, Any]) -> set[str]:
    """Return the names of the schemas that a schema refers to, directly or not."""
    found: set[str] = set()
    todo: list[Any] = [schema]
    while todo:
        one = todo.pop()
        todo += one.values() if isinstance(one, dict) else one if isinstance(one, list) else []
        name = str(one.get("$ref", "")).rpartition("/")[2] if isinstance(one, dict) else ""
        if name and name not in found:
            found.add(name)
            todo.append(document["components"]["schemas"][name])
    return found


def test_every_option_has_a_description(document: dict[str, Any]) -> None:
    asked: set[str] = set()
    for _, _, operation in operations(document):
        asked |= reached(document, operation.get("requestBody", {}))
    schemas = document["components"]["schemas"]
    assert {"SearchOptions", "EstimatorOptions", "VectorizeOptions", "AnalyzeRequest", "CheckRequest"} <= asked
    fields = [(name, field, of) for name in asked for field, of in schemas[name].get("properties", {}).items()]
    bare = [(name, field) for name, field, of in fields if not of.get("description") and "$ref" not in of]
    assert bare == []


def test_codes_and_statuses_are_enumerations(document: dict[str, Any]) -> None:
    schemas = document["components"]["schemas"]
    known = {"ReasonAnswer": get_args(ReasonCode), "Problem": KINDS, "WarningAnswer": get_args(WarningCode)}
    known |= {"FindingAnswer": get_args(FindingCode)}
    for name, codes in known.items():
        assert set(schemas[name]["properties"]["code"]["enum"]) == set(codes), name
    assert set(schemas["AnalyzedPlaceAnswer"]["properties"]["reasons"]["items"]["enum"]) == set(get_args(ReasonCode))
    for name in ("FoundAnswer", "AssociateAnswer", "AnalyzedPlaceAnswer", "WithLandmarkAnswer"):
        assert set(schemas[name]["properties"]["status"]["enum"]) == set(Status), name


def test_times_and_the_scans_of_a_batch_are_typed(document: dict[str, Any]) -> None:
    schemas = document["components"]["schemas"]
    for name, schema in schemas.items():
        if timing := schema.get("properties", {}).get("timing_ms"):
            (times,) = reached(document, timing)
            assert {"total"} < set(schemas[times]["properties"]), name
    assert schemas["BatchRequest"]["properties"]["scans"]["items"] == {
        "oneOf": schemas["AssociateRequest"]["properties"]["scan"]["oneOf"]
    }
    assert reached(document, schemas["BatchRequest"]["properties"]["priors"]) >= {"SoftPriorFields", "HardPriorFields"}
