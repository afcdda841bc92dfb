"""Results of a map check."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from registration import RigidTransform

FindingCode = Literal[
    "unlikely_size",
    "reversed",
    "mixed_directions",
    "short_pieces",
    "doubled_faces",
    "both_ways",
    "overlaps",
    "gaps",
    "looks_alike",
    "centre_lines",
    "thickness",
    "undirected",
    "mirrored",
    "scale",
    "moved",
]
"""Codes of findings: the first nine of a map alone, the others of sample scans."""


@dataclass(frozen=True, slots=True)
class Finding:
    """Something doubtful: a stable code, a plain sentence, and the indices of the map segments that it is about."""

    code: FindingCode
    message: str
    segments: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Size:
    """Size of a map.

    Attributes
    ----------
    segment_count : int
        As sent.
    walls : int
        Number of walls when collinear segments are joined.
    length : float
        Of the walls together, metres.
    diagonal : float
        Of the box around them, metres.
    """

    segment_count: int
    walls: int
    length: float
    diagonal: float


@dataclass(frozen=True, slots=True)
class Place:
    """A place from which the map looks as from another place.

    Attributes
    ----------
    pose : RigidTransform
        In the map frame.
    similar_pose : RigidTransform
        A pose at which the scan looks about the same.
    """

    pose: RigidTransform
    similar_pose: RigidTransform


@dataclass(frozen=True, slots=True)
class Advice:
    """Advised properties of the map; None where there is no evidence for a value.

    Attributes
    ----------
    sigma : float or None
        Standard deviation of its lines normal to themselves, metres.
    oriented : bool or None
        True when directions of its segments mean anything.
    """

    sigma: float | None = None
    oriented: bool | None = None


@dataclass(frozen=True, slots=True)
class MapCheck:
    """Result of the check of a map without scans.

    Attributes
    ----------
    size : Size
    findings : tuple of Finding
        The weightiest first.
    advice : Advice
    places : tuple of Place
    viewpoints : int
        From how many places it was looked for others that are alike.
    complete : bool
        False when the deadline ended it.
    """

    size: Size
    findings: tuple[Finding, ...]
    advice: Advice
    places: tuple[Place, ...]
    viewpoints: int
    complete: bool


@dataclass(frozen=True, slots=True)
class SampleReport:
    """Result of all sample scans together.

    Attributes
    ----------
    findings : tuple of Finding
    advice : Advice
    usable : int
        Of the scans, as the map is.
    usable_as_advised : int
        With the advice taken.
    wall_thickness : float or None
        By how much walls are thicker than drawn, metres; None where nothing speaks for it.
    """

    findings: tuple[Finding, ...]
    advice: Advice
    usable: int
    usable_as_advised: int
    wall_thickness: float | None = None
