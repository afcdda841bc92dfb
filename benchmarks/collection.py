"""Scans with known poses and the maps that they are to be found in."""

from __future__ import annotations

import re
import zlib
from dataclasses import dataclass, field

from association import MapIndex, Scan
from registration import MeasuredSegments, RigidTransform, Segments

LEVELS = ("scan", "scan_30", "scan_50")
SIGMA = 0.02  # m, the noise of the drawn scans and the default of a caller

FLOOR_PLANS = ("apartments", "public_buildings", "campus_buildings")
FOLDS = 5  # of the floor plans

MapKey = tuple[str, str]  # family and id


@dataclass(frozen=True, slots=True)
class Query:
    """A scan to be found in a map.

    Attributes
    ----------
    family, map_id : str
        Name the map.
    number : int
        Position in its file, or of the scan in its log.
    level : str
        One of `LEVELS`: without unmapped obstacles, or with so many that 30 or 50 % of the segments are theirs.
    pose : RigidTransform
        The truth, map_from_scan.
    segments : Segments
        In the sensor's frame.
    lead : float or None
        By how much the truth leads every other pose in explained length; None if not computed.
    """

    family: str
    map_id: str
    number: int
    level: str
    pose: RigidTransform
    segments: Segments
    lead: float | None = None

    @property
    def map(self) -> MapKey:
        """The map that it is from."""
        return self.family, self.map_id

    @property
    def scan(self) -> Scan:
        """The scan as a caller without further knowledge would send it."""
        return Scan(MeasuredSegments.from_segments(self.segments, SIGMA))


@dataclass(frozen=True)
class Collection:
    """Queries, their maps, and what counts as right.

    Attributes
    ----------
    name : str
    maps : dict
    queries : tuple of Query
    distance, angle : float
        Metres and degrees that an answer may be off.
    """

    name: str
    maps: dict[MapKey, Segments]
    queries: tuple[Query, ...]
    distance: float
    angle: float
    _indexes: dict[MapKey, MapIndex] = field(default_factory=dict, repr=False)

    def index(self, key: MapKey) -> MapIndex:
        """Return the map's index, built at the first call."""
        if key not in self._indexes:
            self._indexes[key] = MapIndex.build(self.maps[key])
        return self._indexes[key]


def building(key: MapKey) -> str:
    """Return the building that a map is a floor or a variant of."""
    family, name = key
    if family == "campus_buildings":
        return name[:8]
    if family == "apartments":
        return name[:-5]
    if family == "public_buildings":
        return re.sub(r"[_P]*\d+$", "", name)
    return name


def fold(key: MapKey) -> int:
    """Return which fold of a cross-validation a map belongs to: whole buildings, by a hash; a log of its own."""
    hashed = zlib.crc32(building(key).encode())
    return hashed % FOLDS if key[0] in FLOOR_PLANS else FOLDS + hashed
