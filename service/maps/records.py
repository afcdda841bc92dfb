"""Properties of a stored map, and how damage to it shows."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Row

Bounds = tuple[float, float, float, float]
ABSENT = ""  # the sha256 of a map that was deleted


@dataclass(frozen=True, slots=True)
class MapRecord:
    """The identity of a stored map's content; `oriented` is in the content, too, and is needed before that is read."""

    map_id: str
    revision: int
    sha256: str
    oriented: bool | None = None


@dataclass(frozen=True, slots=True)
class MapOutline:
    """The properties of a map without its content.

    Attributes
    ----------
    segments : int
        The number of segments.
    bounds : tuple
        ``min_x, min_y, max_x, max_y``, metres.
    sigma : float, or None
        Standard deviation of its lines, metres; None where the map does not state it.
    oriented : bool, or None
        True when directions of its segments mean anything; None where the map does not state it.
    """

    segments: int
    bounds: Bounds
    sigma: float | None = None
    oriented: bool | None = None

    def as_json(self, map_id: str, revision: int) -> dict[str, Any]:
        """Return the summary of a stored map as the contract has it."""
        return {
            "map_id": map_id,
            "revision": revision,
            "segment_count": self.segments,
            "bounds": self.bounds,
            "sigma": self.sigma,
            "oriented": self.oriented,
        }


@dataclass(frozen=True, slots=True)
class MapSummary:
    """A stored map without its content."""

    map_id: str
    revision: int
    outline: MapOutline


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
    """Return the SHA-256 of a document; of a value that is no bytes, as after damage, text that never matches."""
    return hashlib.sha256(document).hexdigest() if isinstance(document, bytes) else "damaged"


NOTHING = MapOutline(0, (0.0, 0.0, 0.0, 0.0))
"""Of a map that was deleted."""
SEALED = (
    "map_id", "revision", "sha256", "segments", "min_x", "min_y", "max_x", "max_y", "sigma", "oriented",
)  # fmt: skip
"""Columns that the seal of a row is made of, in this order."""


def columns_of(record: MapRecord, outline: MapOutline) -> dict[str, Any]:
    """Return a sealed row of `maps`.

    The seal is a SHA-256 of all values of the row. A flipped bit in a revision is found as surely as one in a document.
    """
    # SQLite does not keep the sign of zero.
    numbers = tuple(value + 0.0 for value in outline.bounds)
    sigma = None if outline.sigma is None else outline.sigma + 0.0
    what = (record.map_id, record.revision, record.sha256, outline.segments, *numbers, sigma, outline.oriented)
    return dict(zip(SEALED, what, strict=True)) | {"seal": seal(*what), "quarantined": False}


def is_sealed(row: Row[Any]) -> bool:
    """Return whether a row of `maps` is as it was written."""
    return bool(row.seal == seal(*(getattr(row, name) for name in SEALED)))


def seal(*what: object) -> str:
    """Return the SHA-256 of the values of a row, in this order."""
    # repr distinguishes 1, 1.0 and "1", and gives a float to the bit.
    return hashlib.sha256(repr(what).encode("utf-8", "surrogatepass")).hexdigest()
