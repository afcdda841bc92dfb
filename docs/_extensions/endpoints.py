"""Directive ``endpoint``: the fields and statuses of an endpoint of HTTP, from the service's OpenAPI document.

Each object of the contract is described on one page: that of the first endpoint in `PAGES` that uses it.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

Json = dict[str, Any]
PAGES = {
    "associate": ("POST /v1/associate",),
    "register": ("POST /v1/register",),
    "batch": ("POST /v1/associate:batch",),
    "vectorize": ("POST /v1/vectorize",),
    "maps": ("PUT /v1/maps/{map_id}", "GET /v1/maps/{map_id}", "DELETE /v1/maps/{map_id}", "GET /v1/maps"),
    "check": ("GET /v1/maps/{map_id}:check", "POST /v1/maps/{map_id}:check"),
    "import": ("POST /v1/maps:import", "POST /v1/scans:import"),
    "analyze": ("POST /v1/maps/{map_id}:analyze", "POST /v1/analyze"),
    "update": ("POST /v1/maps/{map_id}:update", "POST /v1/maps:apply"),
    "operations": ("GET /v1/limits", "GET /version", "GET /livez", "GET /readyz", "GET /metrics"),
}
ANY = 1e9  # the limit of each number in the contract, which the conventions name once
PREFIX = "#/components/schemas/"


@cache
def contract() -> Json:
    """Return the OpenAPI document of this version."""
    from service.app import create_app
    from service.http.openapi import describe
    from service.settings import Settings

    return dict(describe(create_app(Settings()), guarded=False))


def operation(endpoint: str) -> Json:
    """Return the operation of an endpoint; raises `KeyError` where there is none."""
    method, path = endpoint.split()
    found: Json = contract()["paths"][path][method.lower()]
    return found


def bodies(found: Json) -> Iterator[tuple[str, Json]]:
    """Give the schemas of request and answer with their titles."""
    parts = [("Request", found.get("requestBody", {}))]
    parts += [("Answer", answer) for code, answer in found["responses"].items() if code.startswith("2")]
    for title, part in parts:
        for content in part.get("content", {}).values():
            if "schema" in content:
                yield title, content["schema"]


def references(schema: Any) -> Iterator[str]:
    """Give the names of the objects in a schema, outermost first."""
    if isinstance(schema, list):
        for one in schema:
            yield from references(one)
    elif isinstance(schema, dict):
        if str(schema.get("$ref", "")).startswith(PREFIX):
            yield schema["$ref"].removeprefix(PREFIX)
        for key, one in schema.items():
            if key not in ("example", "examples", "default", "discriminator"):
                yield from references(one)


def reached(schema: Any) -> list[str]:
    """Return the names of all objects that a schema uses, in the order of their first use."""
    found: list[str] = []
    waiting = list(references(schema))
    while waiting:
        name = waiting.pop(0)
        if name not in found:
            found.append(name)
            waiting += references(contract()["components"]["schemas"][name])
    return found


@cache
def owners() -> dict[str, str]:
    """Return the page that describes each object."""
    found: dict[str, str] = {}
    for page, endpoints in PAGES.items():
        for endpoint in endpoints:
            for _, schema in bodies(operation(endpoint)):
                for name in reached(schema):
                    found.setdefault(name, page)
    return found


def kind_of(schema: Json) -> str:
    """Return the type of a value in Markdown, with its range."""
    if "$ref" in schema:
        name = schema["$ref"].removeprefix(PREFIX)
        return f"[{name}](#schema-{name.lower()})" if name in owners() else name
    for key in ("oneOf", "anyOf"):
        if key in schema:
            return " or ".join(dict.fromkeys(kind_of(one) for one in schema[key]))
    if "enum" in schema or "const" in schema:
        return ", ".join(f"`{one}`" for one in schema.get("enum", [schema.get("const")]))
    if schema.get("type") == "array":
        least, most = schema.get("minItems"), schema.get("maxItems")
        count = f"{most} " if least == most and most is not None else f"up to {most} " if most is not None else ""
        return f"list of {count}{kind_of(schema.get('items', {}))}"
    return f"{schema.get('type', 'any JSON')}{interval(schema)}"


def interval(schema: Json) -> str:
    """Return the range of a number, with a space in front."""
    low, above = schema.get("minimum"), schema.get("exclusiveMinimum")
    high, below = schema.get("maximum"), schema.get("exclusiveMaximum")
    low, high = (None if one is not None and abs(one) >= ANY else one for one in (low, high))
    parts = [f"from {low:g}"] if low is not None else [f"above {above:g}"] if above is not None else []
    parts += [f"to {high:g}"] if high is not None else [f"below {below:g}"] if below is not None else []
    return " " + " ".join(parts) if parts else ""


def cell(text: Any) -> str:
    """Return a text as the cell of a table."""
    return " ".join(str(text).split()).replace("|", "\\|")


def default_of(name: str, schema: Json, required: list[str]) -> str:
    """Return the default of a field in Markdown."""
    if "default" not in schema:
        return "required" if name in required else ""
    value = schema["default"]
    if value is None:
        return "null"
    return "" if isinstance(value, dict) else f"`{value}`" if isinstance(value, str) else str(value).lower()


def table_of(name: str) -> Iterator[str]:
    """Give the lines of Markdown that describe an object."""
    schema = contract()["components"]["schemas"][name]
    yield f"(schema-{name.lower()})="
    yield f"**{name}.** {cell(schema.get('description', ''))}"
    yield ""
    fields, required = schema.get("properties", {}), schema.get("required", [])
    optional = [field for field in fields if field not in required]
    if fields:
        yield "| field | type | default | meaning |" if optional else "| field | type | meaning |"
        yield "|---|---|---|---|" if optional else "|---|---|---|"
    for field, one in fields.items():
        default = f" {cell(default_of(field, one, required))} |" if optional else ""
        yield f"| `{field}` | {cell(kind_of(one))} |{default} {cell(one.get('description', ''))} |"
    yield ""


def lines_of(page: str, endpoints: list[str]) -> Iterator[str]:
    """Give the lines of Markdown that describe endpoints."""
    shown: set[str] = set()
    for endpoint in endpoints:
        found = operation(endpoint)
        yield f"**`{endpoint}`**: {cell(found.get('description') or found.get('summary', ''))}"
        yield ""
        for parameter in found.get("parameters", []):
            meaning = cell(parameter.get("description", ""))
            yield f"- `{parameter['name']}` in the {parameter['in']}, {kind_of(parameter['schema'])}: {meaning}"
        for title, schema in bodies(found):
            yield f"- {title}: {kind_of(schema)}"
        yield "- Other statuses: see [Errors](errors.md)"
        yield ""
    for endpoint in endpoints:
        for _, schema in bodies(operation(endpoint)):
            for name in reached(schema):
                if name not in shown and owners()[name] == page:
                    shown.add(name)
                    yield from table_of(name)


class Endpoint(SphinxDirective):
    """Describe the endpoints that the content names, one a line."""

    has_content = True

    def run(self) -> list[nodes.Node]:
        """Return the description."""
        page = self.env.docname.rpartition("/")[2]
        endpoints = [line for line in self.content if line.strip()]
        if tuple(endpoints) != PAGES.get(page):
            raise self.error(f"expected the endpoints {PAGES.get(page)} of the page {page}, found {endpoints}")
        container = nodes.container()
        self.state.nested_parse(StringList(list(lines_of(page, endpoints)), source="openapi"), 0, container)
        return container.children


def setup(app: Sphinx) -> Json:
    """Add the directive to Sphinx."""
    app.add_directive("endpoint", Endpoint)
    return {"parallel_read_safe": True}
