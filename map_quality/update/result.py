"""Results of a map update, and a map with some of its changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from registration import InvalidArgumentError, Segments

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
Bools = NDArray[np.bool_]
ChangeCode = Literal["removed", "added", "moved", "extended", "shortened"]
KeptCode = Literal["still_seen", "little_passed", "worse_without"]


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
class KeptWalls:
    """Walls of the map that stay although beams of several visits pass through a part of them.

    Attributes
    ----------
    code : KeptCode
    message : str
        The reason.
    segments : tuple of int
        Indices of the old map's segments.
    """

    code: KeptCode
    message: str
    segments: tuple[int, ...]


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
    kept : tuple of KeptWalls
        At most one for each code.
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
    kept: tuple[KeptWalls, ...] = ()
    complete: bool = True


def apply_changes(
    known: Segments, sigma: float | None, changes: Sequence[Replacement], sharpened: Sharpened = NOT_SHARPENED
) -> tuple[Segments, float | None]:
    """Return a map with the changes that were accepted, and the standard deviation of its lines.

    Parameters
    ----------
    known : Segments
        The old map, metres.
    sigma : float or None
        Standard deviation of its lines, metres; None: not declared.
    changes : sequence of Replacement
        Those of a proposal that were accepted.
    sharpened : Sharpened, optional
        Of the same proposal.

    Raises
    ------
    InvalidArgumentError
        When a change or a sharpened wall names a segment that the old map does not have, two changes name the same
        one, or no segment is left.
    """
    named: set[int] = set()
    for number, one in enumerate(changes):
        unknown = [k for k in one.segments if not 0 <= k < len(known)]
        if unknown:
            told = f"found segment {unknown[0]}, expected indices of the {len(known)} segments of the old map"
            raise InvalidArgumentError(told, argument="changes", index=number)
        if named & set(one.segments) or len(set(one.segments)) < len(one.segments):
            told = "found a segment that was named before, expected each segment once; accept one of the changes"
            raise InvalidArgumentError(told, argument="changes", index=number)
        named.update(one.segments)
    if len(sharpened.segments) and int(sharpened.segments.max()) >= len(known):
        told = f"found segment {int(sharpened.segments.max())}, expected indices below {len(known)}"
        raise InvalidArgumentError(told, argument="sharpened.segments")
    new = apply(with_ends(known, sharpened), changes)
    if not len(new):
        told = "found no segment that is left, expected at least one; refuse a change"
        raise InvalidArgumentError(told, argument="changes")
    return new, sharper_sigma(known, sigma, sharpened)


def apply(known: Segments, changes: Sequence[Replacement]) -> Segments:
    """Return the segments of a map with some changes.

    Segments that no change names keep their order. The first new segment of a change takes the place of its first old
    one; others are appended.
    """
    kept = dict(enumerate(known.endpoints))
    appended: list[Floats] = []
    for one in changes:
        new = list(one.new)
        for old in one.segments:
            kept.pop(old, None)
        if one.segments and new and one.code in ("shortened", "extended"):
            kept[one.segments[0]] = new.pop(0)
        appended += new
    return Segments.derived(np.array([*(kept[k] for k in sorted(kept)), *appended]).reshape(-1, 4))


def with_ends(known: Segments, sharpened: Sharpened) -> Segments:
    """Return a map with its sharpened walls."""
    ends = known.endpoints.copy()
    ends[sharpened.segments] = sharpened.ends
    return Segments.derived(ends)


def sharper_sigma(known: Segments, sigma: float | None, sharpened: Sharpened) -> float | None:
    """Return the standard deviation of all lines of the new map: the root mean square by length, metres."""
    if sigma is None or not len(sharpened.segments):
        return sigma
    each = np.full(len(known), sigma)
    each[sharpened.segments] = sharpened.sigma
    return float(np.sqrt(known.lengths @ each**2 / known.lengths.sum()))
