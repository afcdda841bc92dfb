"""The table of names has each field, and names that exist."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer
from linefix_client import schema as client

import association
import formats
import linefix
import registration
from cli.program import app
from ros2 import messages
from ros2.reporting import values_of
from service.app import create_app
from service.http.openapi import describe
from service.settings import Settings
from tests.linefix.test_locating import ROOM, SEEN

PAGE = Path(linefix.__file__).parent.parent / "docs" / "reference" / "names.md"
ROWS = [
    [re.findall("`([^`]+)`", cell) for cell in line.strip("|").split("|")]
    for line in PAGE.read_text().splitlines()
    if line.startswith("| `")
]
DOCUMENTS = ("AssociateRequest", "AssociateAnswer", "RegisterRequest", "RegisterAnswer")


def fields_of(schemas: dict[str, Any], schema: dict[str, Any], at: str = "") -> Iterator[str]:
    """Yield the fields of a document, each after the name of the object that it is in."""
    if "$ref" in schema:
        schema = schemas[schema["$ref"].rpartition("/")[2]]
    for part in (*schema.get("anyOf", ()), *schema.get("oneOf", ()), *filter(None, [schema.get("items")])):
        yield from fields_of(schemas, part, at)
    for name, one in schema.get("properties", {}).items():
        yield f"{at}.{name}" if at else name
        yield from fields_of(schemas, one, name)


def options_of(command: Any) -> Iterator[str]:
    """Yield the options and arguments of a command and of those below it."""
    for one in command.params:
        yield from (*one.opts, *one.secondary_opts) if one.param_type_name == "option" else (one.metavar or "",)
    for below in getattr(command, "commands", {}).values():
        yield from options_of(below)


def is_in_python(name: str) -> bool:
    owner, _, part = name.removesuffix(")").replace("(", ".").partition(".")
    found = next(getattr(one, owner) for one in (linefix, association, registration, formats) if hasattr(one, owner))
    return part in inspect.signature(found).parameters if name.endswith(")") else not part or hasattr(found, part)


@pytest.fixture(scope="module")
def options() -> set[str]:
    return {word for name in options_of(typer.main.get_command(app)) for word in re.findall(r"--[\w-]+|[A-Z]+", name)}


def test_the_table_has_each_field_once(tmp_path: Path) -> None:
    schemas = describe(create_app(Settings(data_dir=tmp_path)), guarded=False)["components"]["schemas"]
    listed = [name for row in ROWS for name in row[0]]
    assert len(set(listed)) == len(listed)
    assert {name for one in DOCUMENTS for name in fields_of(schemas, schemas[one])} == set(listed)
    for one in DOCUMENTS:
        assert set(getattr(client, one).__annotations__) == set(schemas[one]["properties"])


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0][0])
def test_the_other_names_exist(row: list[list[str]], options: set[str]) -> None:
    _, python, command_line, ros = row
    assert all(map(is_in_python, python)), python
    assert set(command_line) <= options
    answer = linefix.locate(linefix.index_maps({"room": ROOM}), SEEN)
    values = {f"values.{key}" for key in values_of(answer, 0.0)}
    for name in ros:
        kind, _, part = name.partition(".")
        assert name in options | values or not part or part in getattr(messages, kind).__dataclass_fields__, name
