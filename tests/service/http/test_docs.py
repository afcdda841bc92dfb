"""The examples of docs/reference/http are requests that work."""

from __future__ import annotations

import json
import re
from itertools import dropwhile, takewhile
from pathlib import Path
from typing import get_args

import httpx
import pytest

from map_quality import FindingCode
from service.http.problems import TABLE

ROOT = Path(__file__).parents[3]
HTTP = {path.stem: path.read_text() for path in (ROOT / "docs" / "reference" / "http").glob("*.md")}
TEXT = "\n".join(HTTP.values())
LIMITS = (ROOT / "docs" / "reference" / "limits.md").read_text()
OPERATIONS = (ROOT / "docs" / "guides" / "deployment.md").read_text()
CONTRACT = Path(__file__).with_name("openapi-0.1.0.json")
PUT = r"curl -s -X PUT localhost:8000(/v1/maps/\S+) -H 'Content-Type: application/json' -d '([^']*)'"
STORED = re.findall(PUT, TEXT)
ASKED = r"curl -s localhost:8000(/v1/\S+) -H 'Content-Type: application/json' -d '([^']*)'"
EXAMPLES = re.findall(ASKED, TEXT)


@pytest.mark.parametrize(("path", "body"), EXAMPLES, ids=[path for path, _ in EXAMPLES])
def test_an_example_works(client: httpx.Client, path: str, body: str) -> None:
    """Its answer is compared by tests/test_documents.py, where the page shows it."""
    ((place, document),) = STORED
    client.put(place, content=document.encode()).raise_for_status()
    answer = client.post(path, content=body.encode())
    client.delete(place)
    assert answer.status_code == 200, answer.text
    assert answer.json().get("status", "ok") == "ok"
    assert answer.json().get("warnings", []) == []


def test_there_is_an_example_of_each_call(client: httpx.Client) -> None:
    calls = [path for path, item in client.get("/openapi.json").json()["paths"].items() if "post" in item]
    assert {path.replace("{map_id}", "hq-3") for path in calls} - {path for path, _ in EXAMPLES} == {
        *("/v1/associate:batch", "/v1/analyze", "/v1/maps:import", "/v1/scans:import")
    }


@pytest.mark.parametrize(("page", "answer"), [("register", "RegisterAnswer"), ("associate", "AssociateAnswer")])
def test_the_fields_that_a_page_explains_are_those_of_the_contract(page: str, answer: str) -> None:
    schemas = json.loads(CONTRACT.read_text())["components"]["schemas"]
    rows = HTTP[page].partition("Answer" if page == "register" else "## The answer")[2].splitlines()
    table = list(takewhile(lambda row: row.startswith("|"), dropwhile(lambda row: not row.startswith("|"), rows)))
    explained = {name for row in table[2:] for name in re.findall(r"`(\w+)`", row.split("|")[1])}
    assert explained | {"request_id", "timing_ms"} == set(schemas[answer]["properties"])


def test_every_code_is_described() -> None:
    for kind in TABLE:
        assert re.search(rf"\| [^|]*{kind.status}[^|]*\| [^|]*`{kind.code}`", TEXT), kind.code


def test_every_finding_of_a_check_is_described() -> None:
    assert {code for code in get_args(FindingCode) if f"| `{code}` |" not in HTTP["check"]} == set()


def test_the_named_settings_exist() -> None:
    from service.settings import Settings

    for name in re.findall(r"LINEFIX_([A-Z_]+)", TEXT + LIMITS + OPERATIONS):
        assert name.lower() in (*Settings.model_fields, "kernels"), name


def test_the_counts_that_an_operator_is_told_to_watch_are_there(client: httpx.Client) -> None:
    metrics = client.get("/metrics").text
    watched = set(re.findall(r"`(linefix_\w+)`", OPERATIONS))
    assert len(watched) >= 6
    assert {name for name in watched if f"# TYPE {name} " not in metrics} == set()


ROW = re.compile(r"\| `(\w+)` \| (\S+)[^|]*\| (above )?(\d+)[^|]*\| (\d*)[^|]*\|")


def test_the_settings_are_as_the_table_says() -> None:
    from service.settings import Settings

    rows = ROW.findall(LIMITS)
    fields = {name: field for name, field in Settings.model_fields.items() if field.annotation in (int, float)}
    assert {name for name, *_ in rows} == fields.keys()
    for name, default, above, least, most in rows:
        bounds = {key: value for one in fields[name].metadata for key, value in _limits(one)}
        said = {"gt" if above else "ge": float(least), **({"le": float(most)} if most else {})}
        assert bounds == said, name
        assert default == "the" or float(default) == fields[name].default, name


def _limits(bound: object) -> list[tuple[str, float]]:
    return [(key, float(getattr(bound, key))) for key in ("ge", "gt", "le") if hasattr(bound, key)]
