"""Make types from the service's own document: of the Python client (``make client-types``), and of the page.

``make page`` pipes the schemas that this module prints into openapi-typescript.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from service.app import create_app
from service.http.openapi import describe
from service.settings import Settings

SCHEMA = Path(__file__).parent / "python" / "linefix_client" / "schema.py"
FIRST_LINE = '"""Types of requests and answers; `make client-types` makes them from the OpenAPI document."""\n'
HOW = (
    "--input-file-type=openapi", "--output-model-type=typing.TypedDict", "--target-python-version=3.10",
    "--disable-timestamp", "--collapse-root-models", "--formatters=builtin", "--use-schema-description",
)  # fmt: skip
WORDS = {"description", "title", "example", "examples"}


def main() -> None:
    """Write the Python client's types with the generator that is given; without one, print the schemas of the page."""
    with tempfile.TemporaryDirectory() as folder:
        settings = Settings(data_dir=Path(folder))
        described = describe(create_app(settings), guarded=True)
        if len(sys.argv) == 1:
            print(json.dumps(schemas_of_page(described), indent=1, sort_keys=True))
            return
        document, made = Path(folder) / "openapi.json", Path(folder) / "schema.py"
        document.write_text(json.dumps(described))
        subprocess.run([sys.argv[1], f"--input={document}", f"--output={made}", *HOW], check=True)
        lines = [line for line in made.read_text().splitlines() if not line.startswith("#")]
    # Answers may gain fields: none of these is closed.
    text = "\n".join(lines).replace(", closed=True", "").replace("    closed=True,\n", "")
    SCHEMA.write_text(FIRST_LINE + text + "\n")


def schemas_of_page(described: dict[str, Any]) -> dict[str, Any]:
    """Return a document with the shapes alone: a description that changes does not change the page."""
    schemas = {name: _shape(schema) for name, schema in described["components"]["schemas"].items()}
    return {**described, "paths": {}, "components": {"schemas": schemas}}


def _shape(schema: Any) -> Any:
    if isinstance(schema, list):
        return [_shape(one) for one in schema]
    if not isinstance(schema, dict):
        return schema
    kept = {key: _shape(part) for key, part in schema.items() if key not in WORDS or isinstance(part, dict)}
    if isinstance(kept.get("items"), dict) and kept["items"].get("type") == "array":
        kept.pop("minItems", None)  # from which openapi-typescript makes a tuple of arrays
        kept.pop("maxItems", None)
    return kept


if __name__ == "__main__":
    main()
