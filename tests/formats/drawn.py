"""Drawings that tests write."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ezdxf.document import Drawing as Document

from formats import ImportedMap, ImportOptions, read_map

LINKS = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'


def written(folder: Path, name: str, content: str | bytes) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def saved(folder: Path, document: Document, fmt: str = "asc") -> Path:
    path = folder / "plan.dxf"
    document.saveas(path, fmt=fmt)
    return path


def svg(folder: Path, body: str, attributes: str = 'viewBox="0 0 9 9"') -> Path:
    return written(folder, "a.svg", f"<svg {LINKS} {attributes}>\n{body}</svg>")


def feature(coordinates: Any, kind: str = "LineString", **properties: Any) -> dict[str, Any]:
    return {"type": "Feature", "properties": properties, "geometry": {"type": kind, "coordinates": coordinates}}


def geojson(folder: Path, *features: dict[str, Any], **members: Any) -> Path:
    return written(folder, "a.geojson", json.dumps({"type": "FeatureCollection", "features": features} | members))


def imported(path: Path, **options: Any) -> ImportedMap:
    return read_map(path, ImportOptions(**options))
