"""The contract next to that of the last release: names under /v1/ stay as they are, and there may be more."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from .test_openapi import operations, reached

# Written at a release, and only then: curl -s localhost:8000/openapi.json | python -m json.tool > ...
RELEASED = json.loads(Path(__file__).with_name("openapi-0.1.0.json").read_text())
WORDS = {"description", "summary", "title", "example", "examples", "info", "tags", "default"}  # that may change
NARROWED = {"minimum": 1, "exclusiveMinimum": 1, "minItems": 1, "minLength": 1, "maximum": -1, "maxItems": -1}


def breaking(old: Any, new: Any) -> list[str]:
    """Return the places of a contract that break clients of an older one.

    A client sends what requests describe and reads what answers do: nothing that was there may be missing or of
    another type, and a request may neither demand more nor take less. A type of a request that becomes wider is listed,
    too: that is to be seen by a reader, who corrects the file.
    """
    asked: set[str] = set()
    for _, _, operation in operations(old):
        asked |= reached(old, operation.get("requestBody", {}))
    return [*_lost(old, new, "", asked)]


def _lost(old: Any, new: Any, place: str, asked: set[str]) -> Iterator[str]:
    parts = place.split("/")
    of_request = parts[1:3] == ["components", "schemas"] and len(parts) > 3 and parts[3] in asked
    if isinstance(old, dict) and isinstance(new, dict):
        for name in old.keys() - WORDS if parts[-1] != "properties" else old.keys():
            if name not in new and name not in NARROWED:
                yield f"{place}/{name} is gone"
            elif name in NARROWED and isinstance(old[name], int | float):
                if of_request and NARROWED[name] * new.get(name, -1e300 * NARROWED[name]) > NARROWED[name] * old[name]:
                    yield f"{place}/{name} is narrower"
            else:
                yield from _lost(old[name], new[name], f"{place}/{name}", asked)
        if of_request:
            yield from (f"{place}/{name} is new" for name in (NARROWED.keys() | {"required"}) & new.keys() - old.keys())
    elif isinstance(old, list) and isinstance(new, list):
        yield from (f"{place} lacks {one}" for one in old if one not in new and not isinstance(one, dict))
        if parts[-1] == "required" and of_request:
            yield from (f"{place} has {one}" for one in new if one not in old)
        told = [one for one in old if isinstance(one, dict)]
        yield from (f"{place} lacks {one}" for one in told if all([*_lost(one, other, place, asked)] for other in new))
    elif old != new:
        yield f"{place} is {new}, was {old}"


def test_nothing_breaks_clients_of_the_last_release(client: httpx.Client) -> None:
    assert breaking(RELEASED, client.get("/openapi.json").json()) == []


def changed(change: Callable[[Any], object]) -> list[str]:
    other = copy.deepcopy(RELEASED)
    change(other)
    return breaking(RELEASED, other)


def schema(document: Any, name: str) -> Any:
    return document["components"]["schemas"][name]


def options(document: Any) -> Any:
    return schema(document, "SearchOptions")["properties"]


CHANGES: list[tuple[Callable[[Any], object], str]] = [
    (lambda it: it["paths"].pop("/v1/register"), "/v1/register is gone"),
    (lambda it: it["paths"]["/v1/maps/{map_id}"].pop("delete"), "/v1/maps/{map_id}/delete is gone"),
    (lambda it: it["paths"]["/v1/maps/{map_id}"]["put"]["responses"].pop("201"), "/responses/201 is gone"),
    (lambda it: it["paths"]["/v1/maps"]["get"]["parameters"].clear(), "/v1/maps/get/parameters lacks"),
    (lambda it: options(it).pop("seed"), "SearchOptions/properties/seed is gone"),
    (lambda it: schema(it, "SearchOptions").update(required=["seed"]), "SearchOptions/required is new"),
    (lambda it: options(it)["seed"].update(type="string"), "SearchOptions/properties/seed/type is string"),
    (lambda it: options(it)["max_alternatives"].update(maximum=1), "max_alternatives/maximum is narrower"),
    (lambda it: schema(it, "AssociateAnswer")["properties"].pop("usable"), "AssociateAnswer/properties/usable is gone"),
    (lambda it: schema(it, "AssociateAnswer")["required"].remove("status"), "AssociateAnswer/required lacks status"),
    (lambda it: schema(it, "AssociateAnswer")["properties"]["usable"].update(type="string"), "usable/type is string"),
]


@pytest.mark.parametrize(("change", "told"), CHANGES, ids=[told for _, told in CHANGES])
def test_what_breaks_is_named(change: Callable[[Any], object], told: str) -> None:
    assert any(told in line for line in changed(change)), changed(change)


def test_more_breaks_nothing() -> None:
    def more(it: Any) -> None:
        it["paths"]["/v1/more"] = it["paths"]["/v1/register"]
        options(it)["more"] = {"type": "integer"}
        schema(it, "AssociateAnswer")["properties"]["more"] = {"type": "integer"}
        schema(it, "AssociateAnswer")["required"].append("more")
        options(it)["max_alternatives"]["maximum"] += 1

    assert changed(more) == []
