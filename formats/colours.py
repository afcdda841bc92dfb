"""The colours of pictures, one for one thing, as on the page; those of verdicts suit every kind of colour vision."""

from __future__ import annotations

USABLE, AMBIGUOUS, DEGENERATE, NO_MATCH = "#009e73", "#e69f00", "#0072b2", "#d55e00"
VERDICTS = {"usable": USABLE, "ambiguous": AMBIGUOUS, "degenerate": DEGENERATE, "no_match": NO_MATCH}
INK, WALL, POINT = "#101418", "#4a5460", "#8e98a3"
MATCHED, UNMATCHED, CRITICAL = "#2aa0e0", "#e0529c", "#f5dc3d"
CHANGES = {
    "removed": NO_MATCH,
    "added": USABLE,
    "moved": AMBIGUOUS,
    "extended": DEGENERATE,
    "shortened": "#cc79a7",
}  # suit every kind of colour vision, too
ESTIMATE, OTHER = "#6a35c9", "#8f7d00"


def verdict_of(status: str, *, usable: bool) -> str:
    """Return the key of a verdict in `VERDICTS`; one that is ok but not usable counts as ambiguous."""
    return "usable" if usable else "ambiguous" if status == "ok" else status


def rgb(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue, 0 to 255."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)
