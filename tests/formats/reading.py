"""Drawings that tests write, and the content of a file: rows of a map, notes of a report."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from ezdxf.document import Drawing as Document

from formats import ImportedMap, ImportOptions, ImportReport, Log, Note, read_map

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


PARTS = "read", "merged", "dropped", "assumed"


def rows(imported: ImportedMap) -> list[list[float]]:
    """Return the endpoints of a map to a tenth of a millimetre."""
    rounded: list[list[float]] = (np.round(imported.map.segments.endpoints, 4) + 0.0).tolist()
    return rounded


def notes(found: ImportedMap | Log | ImportReport, *parts: str) -> dict[str, Note]:
    """Return the notes of some parts of a report, or of all, by their codes."""
    report = found if isinstance(found, ImportReport) else found.report
    return {note.code: note for part in parts or PARTS for note in getattr(report, part)}


def counts(found: ImportedMap | Log | ImportReport, *parts: str) -> dict[str, int]:
    """Return how many each note counts."""
    return {code: note.count for code, note in notes(found, *parts).items()}
