"""Maps of line segments as they are kept in files."""

from __future__ import annotations

from dataclasses import dataclass, field

from registration import Segments

from .report import ImportReport


@dataclass(frozen=True, slots=True)
class LineMap:
    """A map and what is known of it.

    Attributes
    ----------
    segments : Segments
        Metres in the map frame; free space on the left where `oriented`.
    sigma : float or None
        Standard deviation of the walls normal to themselves, metres; None: not known.
    oriented : bool
        True if the directions mean anything.
    frame_id : str
    meta : dict
        The origin of the map, for people.
    """

    segments: Segments
    sigma: float | None = None
    oriented: bool = True
    frame_id: str = "map"
    meta: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class ImportedMap:
    """A map of another tool's, and what was done to make it.

    Attributes
    ----------
    map : LineMap
    report : ImportReport
    """

    map: LineMap
    report: ImportReport
