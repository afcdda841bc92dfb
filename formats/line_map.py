"""Maps of line segments as they are kept in files."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform, Segments

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
    points : (n, 2) float64
        Objects too small for a wall, metres in the map frame: evidence for the beams of a scan.
    points_sigma : float or None
        Standard deviation of a point, metres; None: 0.05.
    """

    segments: Segments
    sigma: float | None = None
    oriented: bool = True
    frame_id: str = "map"
    meta: dict[str, str] = field(default_factory=dict)
    points: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))
    points_sigma: float | None = None

    @property
    def document(self) -> dict[str, Any]:
        """The fields of a map document, segments and points as arrays; one without points does not mention them."""
        points = {"points": self.points, "points_sigma": self.points_sigma}
        return {
            "segments": self.segments.endpoints,
            "sigma": self.sigma,
            "oriented": self.oriented,
            "frame_id": self.frame_id,
            **(points if len(self.points) else {}),
            "meta": self.meta,
        }


@dataclass(frozen=True, slots=True, eq=False)
class GridPicture:
    """A grid as a picture.

    Attributes
    ----------
    pixels : (rows, columns) uint8
        0 occupied to 255 free; unknown cells are 205, as map_saver writes them. Row 0 is the highest.
    pose : RigidTransform
        map_from_picture: of the lower left corner.
    resolution : float
        Edge of a pixel, metres.
    """

    pixels: NDArray[np.uint8]
    pose: RigidTransform
    resolution: float


@dataclass(frozen=True, slots=True)
class ImportedMap:
    """A map of another tool's, and what was done to make it.

    Attributes
    ----------
    map : LineMap
    report : ImportReport
    picture : GridPicture or None
        Of the grid that the map comes from; None for a drawing.
    """

    map: LineMap
    report: ImportReport
    picture: GridPicture | None = None
