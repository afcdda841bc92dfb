"""Results of a map update."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from registration import Segments

Floats = NDArray[np.float64]
ChangeCode = Literal["removed", "added", "moved", "extended", "shortened"]


@dataclass(frozen=True, slots=True)
class Evidence:
    """Evidence for a change.

    Attributes
    ----------
    beams_through : int
        Beams that pass through the old walls.
    beams_on : int
        Beams that end on the new walls.
    poses : int
        Places that the scans were taken from, squares of 0.5 m.
    visits : int
        Visits that agree with the change.
    first, last : str
        Names of the first and the last of them, in the order in which visits came.
    """

    beams_through: int
    beams_on: int
    poses: int
    visits: int
    first: str
    last: str


@dataclass(frozen=True, slots=True, eq=False)
class Replacement:
    """Segments of a map, and what takes their place.

    Attributes
    ----------
    code : ChangeCode
    segments : tuple of int
        Indices of the old map's segments that it replaces.
    new : (k, 4)
        Segments in their place, metres in the map frame, free space on the left.
    sigma : (k,)
        Standard deviation of each normal to itself, metres.
    """

    code: ChangeCode
    segments: tuple[int, ...]
    new: Floats = field(repr=False)
    sigma: Floats = field(repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class Change(Replacement):
    """A proposed change of a map.

    Attributes
    ----------
    evidence : Evidence
    confidence : float
        Above 0 and below 1.
    """

    evidence: Evidence
    confidence: float


@dataclass(frozen=True, slots=True, eq=False)
class Sharpened:
    """Walls of a map at better positions, estimated from all scans.

    Attributes
    ----------
    segments : (k,)
        Indices of the old map's segments that moved.
    ends : (k, 4)
        Metres in the map frame.
    sigma : (k,)
        Standard deviation of each normal to itself, metres.
    """

    segments: NDArray[np.intp]
    ends: Floats = field(repr=False)
    sigma: Floats = field(repr=False)


NOT_SHARPENED = Sharpened(np.zeros(0, dtype=np.intp), np.zeros((0, 4)), np.zeros(0))


@dataclass(frozen=True, slots=True)
class Usable:
    """Number of scans, and of those that are usable on the old and on the new map."""

    scans: int
    before: int
    after: int


@dataclass(frozen=True, slots=True)
class RefusedVisit:
    """A visit that gives no evidence, and the reason."""

    visit: str
    message: str


@dataclass(frozen=True, slots=True)
class MapUpdate:
    """A proposal; nothing is stored.

    Attributes
    ----------
    segments : Segments
        Of the new map, with the accepted changes.
    sigma : float or None
        Of the new map.
    changes : tuple of Change
        All that are proposed, the surest first.
    accepted : tuple of bool
        Which of them are in the new map.
    usable : Usable
        Scans that gave evidence, and those without evidence that were searched, too.
    held_back : Usable
        Scans that gave no evidence and test the proposal.
    sharpened : Sharpened
        Walls that are in the new map at better positions; they are in no change.
    refused_visits : tuple of RefusedVisit
    complete : bool
        False if the deadline ended it; then no change is proposed that was not verified.
    """

    segments: Segments
    sigma: float | None
    changes: tuple[Change, ...]
    accepted: tuple[bool, ...]
    usable: Usable
    held_back: Usable
    sharpened: Sharpened = NOT_SHARPENED
    refused_visits: tuple[RefusedVisit, ...] = ()
    complete: bool = True
