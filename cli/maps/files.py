"""Maps to files."""

from __future__ import annotations

from pathlib import Path

import orjson

from ..contract import Json
from ..inputs import line_map_of, needing_formats


def write_document(document: Json, out: Path) -> None:
    """Write a map in the format of the file's name.

    Raises
    ------
    RefusedError
        When it has another, or the extra ``[formats]`` is missing.
    """
    if out.suffix.lower() == ".json":
        out.write_bytes(orjson.dumps(document) + b"\n")
        return
    with needing_formats(f"writing {out.name}"):
        from formats import write_map

        write_map(line_map_of(document), out)
