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
DEMANDS = ("required", "minimum", "exclusiveMinimum", "minItems", "minLength", "maximum", "maxItems", "maxLength")


def places(value: Any, at: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the places of a contract and the values there; of a list, items are at their names, types or values."""
    yield at, None if isinstance(value, dict | list) else value
    if isinstance(value, dict):
        for name, one in value.items():
            if name not in WORDS or at.endswith("/properties"):
                yield from places(one, f"{at}/{name}")
    for one in value if isinstance(value, list) else ():
        named = [one.get(key) for key in ("name", "$ref", "type")] if isinstance(one, dict) else [one]
        yield from places(one, f"{at}/{next(filter(None, named), '')}")


def breaking(old: Any, new: Any) -> list[str]:
    """Return the places of a contract that break clients of an older one.

    A client sends what requests describe and reads what answers do: nothing that was there may be missing or of
    another value, and a request may not demand more. A field that a request takes in addition is listed, too, and a
    bound or a type that becomes wider: that is to be seen by a reader, who corrects the file.
    """
    was, now = dict(places(old)), dict(places(new))
    asked: set[str] = set()
    for _, _, operation in operations(old):
        asked |= reached(old, operation.get("requestBody", {}))
    lost = [f"{at} is {now[at]}, was {value}" for at, value in was.items() if at in now and now[at] != value]
    gone = [f"{at} is gone" for at in was.keys() - now.keys()]
    return [*lost, *gone, *(f"{at} is new" for at in now.keys() - was.keys() if _is_demanded(at, was, asked))]


def _is_demanded(at: str, was: dict[str, Any], asked: set[str]) -> bool:
    """Return whether a place that is new demands more of a request that there was before."""
    parts = at.split("/")
    first = next((number for number, part in enumerate(parts) if number > 3 and part in DEMANDS), 0)
    return first > 0 and parts[3] in asked and "/".join(parts[:first]) in was


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
    (lambda it: it["paths"]["/v1/maps"]["get"]["parameters"].clear(), "/v1/maps/get/parameters/limit is gone"),
    (lambda it: options(it).pop("seed"), "SearchOptions/properties/seed is gone"),
    (lambda it: schema(it, "SearchOptions").update(required=["seed"]), "SearchOptions/required/seed is new"),
    (lambda it: options(it)["seed"].update(type="string"), "SearchOptions/properties/seed/type is string"),
    (lambda it: options(it)["max_alternatives"].update(maximum=1), "max_alternatives/maximum is 1, was 50"),
    (lambda it: schema(it, "AssociateAnswer")["properties"].pop("usable"), "AssociateAnswer/properties/usable is gone"),
    (lambda it: schema(it, "AssociateAnswer")["required"].remove("status"), "AssociateAnswer/required/status is gone"),
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

    assert changed(more) == []
