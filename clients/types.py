"""Make the Python client's types from the service's own document: ``make client-types``."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from service.app import create_app
from service.http.openapi import describe
from service.settings import Settings

SCHEMA = Path(__file__).parent / "python" / "linefix_client" / "schema.py"
FIRST_LINE = '"""Types of requests and answers; `make client-types` makes them from the OpenAPI document."""\n'
HOW = (
    "--input-file-type=openapi", "--output-model-type=typing.TypedDict", "--target-python-version=3.10",
    "--disable-timestamp", "--collapse-root-models", "--formatters=builtin", "--use-schema-description",
)  # fmt: skip


def main() -> None:
    """Write the types; the generator is the first argument."""
    with tempfile.TemporaryDirectory() as folder:
        document, made = Path(folder) / "openapi.json", Path(folder) / "schema.py"
        settings = Settings(data_dir=Path(folder))
        document.write_text(json.dumps(describe(create_app(settings), guarded=True)))
        subprocess.run([sys.argv[1], f"--input={document}", f"--output={made}", *HOW], check=True)
        lines = [line for line in made.read_text().splitlines() if not line.startswith("#")]
    # Answers may gain fields: none of these is closed.
    text = "\n".join(lines).replace(", closed=True", "").replace("    closed=True,\n", "")
    SCHEMA.write_text(FIRST_LINE + text + "\n")


if __name__ == "__main__":
    main()
