"""The examples of docs/http.md are requests that work."""

from __future__ import annotations

import re
from pathlib import Path

import httpx
import pytest

from service.http.problems import TABLE

ROOT = Path(__file__).parents[3]
TEXT = (ROOT / "docs" / "http.md").read_text()
OPERATIONS = (ROOT / "docs" / "operations.md").read_text()
README = (ROOT / "README.md").read_text()
STORED = re.findall(
    r"curl -s -X PUT localhost:8000(/v1/maps/\S+) -H 'Content-Type: application/json' -d '([^']*)'", TEXT
)
ASKED = r"curl -s localhost:8000(/v1/\S+) -H 'Content-Type: application/json' -d '([^']*)'"
EXAMPLES = re.findall(ASKED, TEXT)


def test_there_are_examples() -> None:
    assert [path for path, _ in STORED] == ["/v1/maps/hq-3"]
    assert [path for path, _ in EXAMPLES] == [
        "/v1/register",
        "/v1/associate",
        "/v1/vectorize",
        "/v1/associate",
        "/v1/maps/hq-3:check",
        "/v1/maps/hq-3:analyze",
    ]


@pytest.mark.parametrize(("path", "body"), EXAMPLES)
def test_an_example_works(client: httpx.Client, path: str, body: str) -> None:
    for place, document in STORED:
        client.put(place, content=document.encode()).raise_for_status()
    answer = client.post(path, content=body.encode())
    for place, _ in STORED:
        client.delete(place)
    assert answer.status_code == 200, answer.text
    if path == "/v1/vectorize":
        assert len(answer.json()["segments"]) == 1
    elif path.endswith(":analyze"):
        assert answer.json()["summary"]["usable"] > 20
    elif path.endswith(":check"):
        assert (answer.json()["findings"], answer.json()["samples"]["usable"]) == ([], 1)
    else:
        assert (answer.json()["status"], answer.json()["usable"]) == ("ok", True)
        assert answer.json().get("warnings", []) == []
        assert answer.json()["pose"]["x"] == pytest.approx(1.0, abs=1e-6)


def test_the_first_thing_that_a_reader_tries_is_answered_as_the_readme_says(client: httpx.Client) -> None:
    ((path, body),) = re.findall(ASKED, README)
    answer = client.post(path, content=body.encode()).json()
    assert (answer["status"], answer["usable"], answer["unmatched_scan"]) == ("ok", True, [4])
    assert answer["warnings"] == []
    said = re.search(r'"pose":\{"x":([\d.]+), ?"y":([\d.]+), ?"theta":([\d.]+)\}', README)
    assert said is not None
    assert [float(number) for number in said.groups()] == pytest.approx(list(answer["pose"].values()), abs=1e-3)


def test_every_code_is_described() -> None:
    for kind in TABLE:
        assert re.search(rf"\| [^|]*{kind.status}[^|]*\| [^|]*`{kind.code}`", TEXT), kind.code


def test_every_finding_of_a_check_is_described() -> None:
    source = "".join(path.read_text() for path in (ROOT / "association" / "checking").glob("*.py"))
    codes = set(re.findall(r'Finding\(\s*"(\w+)"', source))
    assert len(codes) >= 13
    described = TEXT.partition("### Check")[2].partition("## Errors")[0]
    assert {code for code in codes if f"| `{code}` |" not in described} == set()


def test_the_named_settings_exist() -> None:
    from service.settings import Settings

    for name in re.findall(r"LINEFIX_([A-Z_]+)", TEXT + OPERATIONS):
        assert name.lower() in (*Settings.model_fields, "kernels"), name


def test_the_counts_that_an_operator_is_told_to_watch_are_there(client: httpx.Client) -> None:
    metrics = client.get("/metrics").text
    watched = set(re.findall(r"`(linefix_\w+)`", OPERATIONS))
    assert len(watched) >= 6
    assert {name for name in watched if f"# TYPE {name} " not in metrics} == set()


ROW = re.compile(r"\| `(\w+)` \| (\S+)[^|]*\| (above )?(\d+)[^|]*\| (\d*)[^|]*\|")


def test_the_settings_are_as_the_table_says() -> None:
    from service.settings import Settings

    rows = ROW.findall(TEXT.partition("## Operations")[2])
    fields = {name: field for name, field in Settings.model_fields.items() if field.annotation in (int, float)}
    assert {name for name, *_ in rows} == fields.keys()
    for name, default, above, least, most in rows:
        bounds = {key: value for one in fields[name].metadata for key, value in _limits(one)}
        said = {"gt" if above else "ge": float(least), **({"le": float(most)} if most else {})}
        assert bounds == said, name
        assert default == "the" or float(default) == fields[name].default, name


def _limits(bound: object) -> list[tuple[str, float]]:
    return [(key, float(getattr(bound, key))) for key in ("ge", "gt", "le") if hasattr(bound, key)]
