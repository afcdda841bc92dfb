"""The contract next to that of the last release: names under /v1/ stay as they are."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest

from .breaking import breaking

# Written at a release, and only then: curl -s localhost:8000/openapi.json | python -m json.tool > ...
RELEASED = json.loads(Path(__file__).with_name("openapi-0.1.0.json").read_text())


def test_nothing_breaks_clients_of_the_last_release(client: httpx.Client) -> None:
    found = breaking(RELEASED, client.get("/openapi.json").json())
    assert found == [], "this breaks clients, see tests/service/http/breaking.py:\n" + "\n".join(found)


def changed(change: Callable[[Any], object]) -> list[str]:
    other = copy.deepcopy(RELEASED)
    change(other)
    return breaking(RELEASED, other)


def schema(document: Any, name: str) -> Any:
    return document["components"]["schemas"][name]


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda it: it["paths"].pop("/v1/register"), "POST /v1/register: gone"),
        (lambda it: it["paths"]["/v1/maps/{map_id}"].pop("delete"), "DELETE /v1/maps/{map_id}: gone"),
        (lambda it: it["paths"]["/v1/maps/{map_id}"]["put"]["responses"].pop("201"), "no 201 any more"),
        (lambda it: it["paths"]["/v1/maps"]["get"]["parameters"].clear(), "parameter cursor gone"),
        (lambda it: schema(it, "SearchOptions")["properties"].pop("seed"), "request SearchOptions: seed gone"),
        (lambda it: schema(it, "SearchOptions").update(required=["seed"]), "request SearchOptions: seed is required"),
        (
            lambda it: schema(it, "SearchOptions")["properties"]["seed"].update(type="string"),
            "request SearchOptions.seed: no integer any more",
        ),
        (
            lambda it: schema(it, "SearchOptions")["properties"]["max_alternatives"].update(maximum=1),
            "request SearchOptions.max_alternatives: maximum",
        ),
        (lambda it: schema(it, "AssociateAnswer")["properties"].pop("usable"), "answer AssociateAnswer: usable gone"),
        (
            lambda it: schema(it, "AssociateAnswer")["required"].remove("status"),
            "answer AssociateAnswer: status may be missing",
        ),
        (
            lambda it: schema(it, "AssociateAnswer")["properties"]["usable"].update(type="string"),
            "answer AssociateAnswer.usable: may be string",
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_breaks_is_named(change: Callable[[Any], object], told: str) -> None:
    assert any(told in line for line in changed(change)), changed(change)


def test_more_breaks_nothing() -> None:
    def more(it: Any) -> None:
        it["paths"]["/v1/more"] = it["paths"]["/v1/register"]
        schema(it, "SearchOptions")["properties"]["more"] = {"type": "integer"}
        schema(it, "AssociateAnswer")["properties"]["more"] = {"type": "integer"}
        schema(it, "AssociateAnswer")["required"].append("more")
        schema(it, "SearchOptions")["properties"]["max_alternatives"]["maximum"] += 1

    assert changed(more) == []
