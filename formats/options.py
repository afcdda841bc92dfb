"""Options for the import of a file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from registration.limits import MAX_COORDINATE

from .errors import InvalidOptionError

Drawn = Literal["faces", "centres"]

US_FT = 1200 / 3937  # of the US survey, m
UNITS = {"mm": 1e-3, "cm": 0.01, "dm": 0.1, "m": 1, "km": 1e3, "in": 0.0254, "ft": 0.3048, "yd": 0.9144, "us-ft": US_FT}


def _is_place(place: tuple[float, ...]) -> bool:
    return len(place) == 2 and all(math.isfinite(c) and abs(c) <= MAX_COORDINATE for c in place)


@dataclass(frozen=True, slots=True)
class ImportOptions:
    """Values that a file lacks; a grid needs none.

    Attributes
    ----------
    units : str, float or None
        Of a drawing: ``mm``, ``cm``, ``dm``, ``m``, ``km``, ``in``, ``ft``, ``yd``, ``us-ft``, or metres per unit;
        None: as the file says.
    layers : tuple of str
        Patterns such as ``*WALL*``, without regard to case; empty: all layers that are drawn.
    drawn : "faces", "centres" or None
        True if the lines of a drawing are the faces of walls, or run in their middle; None: detected.
    thickness : float or None
        Of walls that are drawn by their centre line, metres, 0 to 10; None: as the drawing says, else 0.2.
    point : tuple of (x, y)
        Free places, metres in the map frame: directions are found from there.
    oriented : bool or None
        True if free space lies on the left of each line, false if directions have no meaning. None: found from
        `point` where given, else as the file says.
    local_metres : bool
        True if the coordinates of a GeoJSON file are metres; else they are degrees, and are refused.
    topic : str or None
        Of the grid in a bag; None: the only one.
    unknown : int, "none" or None
        Grey value of the unknown cells in the picture of a grid, 0 to 255; ``none``: no opaque cell is unknown; None:
        found from the picture.
    where : tuple of str
        Properties of entities to read, as ``property=value``, the value a pattern. Values of one property are
        alternatives, several properties must all fit. Empty: all but those that no laser sees, such as doors.
    level : str or None
        Floor of a drawing that has several, as it names it, or the height of its lines in metres.
    surface : float or None
        Depth of the walls' surface behind the front of a grid's occupied cells, cells, 0 to 10; None: estimated.

    Raises
    ------
    InvalidOptionError
        When a value is out of its range.
    """

    units: str | float | None = None
    layers: tuple[str, ...] = ()
    drawn: Drawn | None = None
    thickness: float | None = None
    point: tuple[tuple[float, float], ...] = ()
    oriented: bool | None = None
    local_metres: bool = False
    topic: str | None = None
    unknown: int | Literal["none"] | None = None
    where: tuple[str, ...] = ()
    level: str | None = None
    surface: float | None = None

    def __post_init__(self) -> None:
        units = ", ".join(UNITS)
        known = self.units in UNITS if isinstance(self.units, str) else self.units is None or 1e-6 <= self.units <= 1e4
        grey = type(self.unknown) is int and 0 <= self.unknown <= 255
        checks = [
            ("units", known, f"one of {units}, or 1e-6 to 1e4 metres per unit"),
            ("drawn", self.drawn in (None, "faces", "centres"), "faces or centres"),
            ("thickness", self.thickness is None or 0.0 <= self.thickness <= 10.0, "from 0 to 10 m"),
            ("unknown", self.unknown in (None, "none") or grey, "none, or a grey value from 0 to 255"),
            ("surface", self.surface is None or 0.0 <= self.surface <= 10.0, "from 0 to 10 cells"),
            ("where", all(one.partition("=")[0].strip() and "=" in one for one in self.where), "property=value"),
            ("point", all(map(_is_place, self.point)), f"two numbers up to {MAX_COORDINATE:g} m"),
        ]
        for argument, good, what in checks:
            if not good:
                value = getattr(self, argument)
                found = "another name" if isinstance(value, str) else repr(value)
                raise InvalidOptionError(f"expected {what}, found {found}", argument=argument)

    @property
    def metres(self) -> float | None:
        """Metres per unit, None where the file says."""
        return UNITS[self.units] if isinstance(self.units, str) else self.units


DEFAULT_OPTIONS = ImportOptions()
