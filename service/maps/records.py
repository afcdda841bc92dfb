"""What is known of a stored map, and how damage to it shows."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Row

Bounds = tuple[float, float, float, float]
ABSENT = ""  # the sha256 of a map that was deleted


@dataclass(frozen=True, slots=True)
class MapRecord:
    """What identifies the content of a stored map."""

    map_id: str
    revision: int
    sha256: str


@dataclass(frozen=True, slots=True)
class MapSummary:
    """A stored map without its content; bounds are ``min_x, min_y, max_x, max_y`` in metres."""

    map_id: str
    revision: int
    segments: int
    bounds: Bounds


@dataclass(frozen=True, slots=True)
class StoredMap:
    """A stored map: its JSON document to the byte."""

    record: MapRecord
    document: bytes


@dataclass(frozen=True, slots=True)
class MapPage:
    """A page of a listing.

    Attributes
    ----------
    maps : list of MapSummary
    corrupt : list of str
        Ids on this page that are quarantined, or whose rows are damaged.
    next : str, or None
        The id to go on from, None on the last page.
    """

    maps: list[MapSummary]
    corrupt: list[str]
    next: str | None


def digest(document: object) -> str:
    """Return the SHA-256 of a document; of what is no bytes, as damage may leave it, nothing that ever matches."""
    return hashlib.sha256(document).hexdigest() if isinstance(document, bytes) else "damaged"


def columns_of(record: MapRecord, segments: int, bounds: Bounds) -> dict[str, Any]:
    """Return a sealed row of `maps`.

    The seal is a SHA-256 of all that the row says: a flipped bit in a revision is found as surely as one in a document.
    """
    numbers = tuple(value + 0.0 for value in bounds)  # SQLite does not keep the sign of zero
    names = ("map_id", "revision", "sha256", "segments", "min_x", "min_y", "max_x", "max_y")
    what = (record.map_id, record.revision, record.sha256, segments, *numbers)
    return dict(zip(names, what, strict=True)) | {"seal": _seal(*what), "quarantined": False}


def is_sealed(row: Row[Any]) -> bool:
    """Tell whether a row of `maps` is as it was written."""
    what = (row.map_id, row.revision, row.sha256, row.segments, row.min_x, row.min_y, row.max_x, row.max_y)
    return bool(row.seal == _seal(*what))


def _seal(*what: object) -> str:
    # repr tells 1 from 1.0 from "1", and gives a float to the bit.
    return hashlib.sha256(repr(what).encode("utf-8", "surrogatepass")).hexdigest()
