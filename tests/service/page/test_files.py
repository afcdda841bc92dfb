"""The files in the package are those that web/ and examples/scenes.py make."""

from __future__ import annotations

import json
import re
from hashlib import sha256
from pathlib import Path

import httpx
import orjson
import pytest

from examples.scenes import FOLDER, SCENES
from tests.running import RunningService

ROOT = Path(__file__).parents[3]
BUILT = ROOT / "service" / "page" / "built"
WEB = ROOT / "web"
CONTRACT = WEB / "src" / "contract.ts"


def hashes(folder: Path, names: list[str]) -> dict[str, str]:
    return {name: sha256((folder / name).read_bytes()).hexdigest() for name in names}


def test_the_page_was_built_from_these_sources() -> None:
    """If this fails, run `make page`."""
    manifest = json.loads((BUILT / "manifest.json").read_text())
    sources = [path.relative_to(WEB).as_posix() for path in WEB.glob("src/*") if path != CONTRACT]
    sources += ["index.html", "package.json", "tsconfig.json", "vite.config.js"]
    assert manifest["sources"] == hashes(WEB, sorted(sources))
    built = sorted(path.name for path in BUILT.iterdir() if path.name != "manifest.json")
    assert built == ["index.html", "page.css", "page.js"]
    assert manifest["built"] == hashes(BUILT, built)


def test_its_types_are_those_of_the_contract(client: httpx.Client) -> None:
    """Where this fails: `make page`."""
    text = CONTRACT.read_text()
    for name, schema in client.get("/openapi.json").json()["components"]["schemas"].items():
        found = re.search(rf"^ {{8}}{name}: (.*?;)$\n^ {{8}}\S", text, re.MULTILINE | re.DOTALL)
        assert found is not None, name
        fields = dict(re.findall(r"^ {12}(\w+)(\??): ", found[1], re.MULTILINE))
        required = {field for field, mark in fields.items() if not mark}
        assert (fields.keys(), required) == (schema.get("properties", {}).keys(), {*schema.get("required", ())}), name
        values = ",".join(re.findall(r'"enum":\[(.*?)\]', orjson.dumps(schema).decode())).split(",")
        assert [value for value in values if value not in found[1]] == [], name


def test_no_file_names_another_host() -> None:
    for path in BUILT.iterdir():
        assert "https://" not in path.read_text(), path.name


@pytest.mark.parametrize("name", SCENES)
def test_an_example_is_what_the_command_draws(name: str) -> None:
    """To a millimetre: the last digit is the processor's."""
    kept, drawn = orjson.loads((FOLDER / f"{name}.json").read_bytes()), SCENES[name]().document()
    assert kept.keys() == drawn.keys()
    assert kept["title"] == drawn["title"]
    assert kept["pose"] == pytest.approx(drawn["pose"], abs=2e-3)
    for mine, other in ((kept["map"]["segments"], drawn["map"]["segments"]), (kept["boxes"], drawn["boxes"])):
        assert len(mine) == len(other)
        for row, expected in zip(mine, other, strict=True):
            assert row == pytest.approx(expected, abs=2e-3)


def test_what_is_served(service: RunningService, client: httpx.Client) -> None:
    page = client.get("/")
    assert page.headers["content-type"].startswith("text/html")
    policy = page.headers["content-security-policy"]
    assert "default-src 'none'; script-src 'self'; style-src 'self';" in policy
    assert "unsafe" not in policy
    for path, kind in (
        ("page.js", "text/javascript"),
        ("page.css", "text/css"),
        ("examples/flat.json", "application/json"),
    ):
        answer = client.get(f"/page/{path}")
        assert (answer.status_code, answer.headers["content-type"].partition(";")[0]) == (200, kind)
    for path in ("manifest.json", "index.html", "__init__.py", "examples/none.json", "examples/..%2f__init__.py"):
        assert client.get(f"/page/{path}").status_code == 404
