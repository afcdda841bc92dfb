"""The content of a file: rows of a map, notes of a report."""

from __future__ import annotations

import numpy as np

from formats import ImportedMap, ImportReport, Log, Note

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
