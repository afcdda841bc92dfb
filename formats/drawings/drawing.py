"""A drawing as all readers give it: polylines in the drawing's own units."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from registration.layout import Floats

from ..errors import MalformedFileError, TooLargeError
from ..limits import MAX_SEGMENTS, MAX_UNITS
from ..options import DEFAULT_OPTIONS, ImportOptions
from ..report import Notes, listed_counts, shown
from .selection import excluded_by, kinds_of, levels_of, lower_keys, matches, walls_among, walls_first

FLAT, STEEP = 1e-3, 0.05  # of the greater extent in the plane: how narrow and how high a section is
LEFT_OUT = {
    "other_layer": "entities on layers that are not read",
    "other_value": "entities that the option where excludes",
    "not_seen": "entities that no laser sees; set the option where to read them",
}


@dataclass(frozen=True, slots=True, eq=False)
class Polyline:
    """Lines that belong together.

    Attributes
    ----------
    ends : (k, 4)
        Units of the drawing.
    width : float
        Units of the drawing; 0 where it has none.
    layer : str
        Empty where it has none.
    levels : tuple of str
        Floors that it is on, as the file names them.
    heights : (float, float)
        Least and greatest z, units of the drawing.
    group : str
        The layer by which it counts as a wall or not; empty where it has none, or this is decided.
    """

    ends: Floats
    width: float = 0.0
    layer: str = ""
    levels: tuple[str, ...] = ()
    heights: tuple[float, float] = (0.0, 0.0)
    group: str = ""


@dataclass(slots=True)
class Drawing:
    """Polylines, y pointing up.

    Attributes
    ----------
    name : str
        Of the file, for errors and reports.
    format : str
    notes : Notes
    options : ImportOptions
        Layers and properties that are wanted.
    metres : float or None
        Per unit of the drawing; None where it does not say.
    oriented : bool
        True if the drawing declares free space on the left of its lines.
    sigma, frame_id, meta
        As in `LineMap`, where the file says.
    points : (n, 2)
        Objects too small for a wall, units of the drawing.
    points_sigma : float or None
        As in `LineMap`.
    polylines : list of Polyline
    walls : set of str or None
        Layers of walls by their names; None: not known, or all.
    """

    name: str
    format: str
    notes: Notes
    options: ImportOptions = DEFAULT_OPTIONS
    metres: float | None = None
    oriented: bool = False
    sigma: float | None = None
    frame_id: str = "map"
    meta: dict[str, str] = field(default_factory=dict)
    points: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    points_sigma: float | None = None
    polylines: list[Polyline] = field(default_factory=list)
    walls: set[str] | None = None
    _left_out: dict[str, Counter[str]] = field(default_factory=dict)
    _kinds: Counter[str] = field(default_factory=Counter)  # of the entities that are taken, by their properties
    _count: int = 0

    def takes(self, layers: tuple[str, ...], properties: Mapping[str, Any] | None = None) -> bool:
        """Tell whether an entity is wanted: by its layers, outermost first, and its properties; count it where not."""
        why = None
        if self.options.layers and not matches(layers, self.options.layers):
            why = "other_layer", layers[-1] if layers else "no layer"
        elif self.walls is not None and layers[-1] not in self.walls:
            why = "other_layer", layers[-1]
        told = lower_keys(properties or {})
        why = why or excluded_by(told, self.options.where)
        if why is not None:
            self._left_out.setdefault(why[0], Counter())[why[1]] += 1
        elif kind := kinds_of(told):
            self._kinds[kind] += 1
        return why is None

    def leave_out_others(self) -> None:
        """Leave out lines that are on no layer of walls; note all that was left out, and the kinds that were not."""
        groups = {one.group for one in self.polylines} - {""}
        if groups and not self.options.layers and not self.options.where:
            walls = walls_among(groups, self.notes) or groups
            others = [one.group for one in self.polylines if one.group and one.group not in walls]
            if others:
                self._left_out.setdefault("other_layer", Counter()).update(others)
                self.polylines = [one for one in self.polylines if not one.group or one.group in walls]
        if len(self._kinds) > 1 and not self.options.where:
            told = (
                f"entities of all kinds are walls: {listed_counts(self._kinds)}; set the option where if some are not"
            )
            self.notes.add_assumed("kinds", told)
        for code, counts in self._left_out.items():
            self.notes.add_dropped(code, f"{LEFT_OUT[code]}: {listed_counts(counts)}", counts.total())

    def add(
        self,
        points: ArrayLike,
        *,
        closed: bool = False,
        width: float = 0.0,
        layers: tuple[str, ...] = (),
        properties: Mapping[str, Any] | None = None,
        groups: tuple[str, ...] = (),
    ) -> None:
        """Add a polyline.

        Parameters
        ----------
        points : array-like of shape (n, 2) or (n, 3)
            Units of the drawing.
        closed : bool
            True if a line runs from the last point to the first.
        width : float
            Units of the drawing.
        layers : tuple of str
            That it is on, outermost first.
        properties : mapping, optional
            May name its floor.
        groups : tuple of str
            The layers that may be named after walls, outermost first.

        Raises
        ------
        MalformedFileError
            When a coordinate is not a finite number, or too large for any unit.
        TooLargeError
            When the drawing has too many lines.
        """
        p = self._checked(points)
        if closed and len(p) > 2 and not np.array_equal(p[0], p[-1]):
            p = np.vstack([p, p[:1]])
        if len(p) >= 2:
            heights = (float(p[:, 2].min()), float(p[:, 2].max())) if p.shape[1] == 3 else (0.0, 0.0)
            levels, ends = levels_of(layers, lower_keys(properties or {})), np.hstack([p[:-1, :2], p[1:, :2]])
            self._keep(Polyline(ends, width, layers[-1] if layers else "", levels, heights, walls_first(groups)))

    def add_segments(self, endpoints: ArrayLike) -> None:
        """Add lines of their own, ``(n, 4)`` units of the drawing; raises as `add` does."""
        self._keep(Polyline(self._checked(endpoints, 4)))

    def _keep(self, polyline: Polyline) -> None:
        self._count += len(polyline.ends)
        if self._count > MAX_SEGMENTS:
            raise TooLargeError(f"expected at most {MAX_SEGMENTS} lines, found {self._count} or more; select layers")
        if len(polyline.ends):
            self.polylines.append(polyline)

    def _checked(self, values: ArrayLike, *columns: int) -> Floats:
        try:
            array = np.asarray(values, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            array = np.array(math.nan)
        columns = columns or (2, 3)
        if array.size == 0:
            return np.zeros((0, columns[0]))
        if array.ndim != 2 or array.shape[1] not in columns or not (np.abs(array) <= MAX_UNITS).all():
            raise MalformedFileError(f"has a coordinate that is not a number up to {MAX_UNITS:g}")
        return array

    def require_plan(self) -> None:
        """Refuse a section or an elevation, which lies in the x-z or y-z plane; raises `MalformedFileError`."""
        corners = np.vstack([one.ends for one in self.polylines]).reshape(-1, 2)
        width, depth = np.ptp(corners, axis=0)
        height = max(one.heights[1] for one in self.polylines) - min(one.heights[0] for one in self.polylines)
        if min(width, depth) <= FLAT * max(width, depth) and height > STEEP * max(width, depth):
            raise MalformedFileError(
                f"is no plan: its lines extend {width:g} by {depth:g} units in x and y, and {height:g} in z, as a "
                "section or an elevation; expected walls in the x-y plane. Rotate the drawing"
            )

    def drop(self, kind: str, *, hint: str = "") -> None:
        """Note what is no wall or cannot be read, and what to do about it."""
        name = shown(kind)
        said = f"{name} is not read" + (f": it {hint}" if hint else "")
        self.notes.add_dropped(f"entity_{name.lower().replace(' ', '_')}", said, 1)

    def without_lines(self) -> MalformedFileError:
        """Return the error for a drawing without lines: it names what is there instead."""
        found = [note.message + (f" ({note.count})" if note.count else "") for note in self.notes.dropped.values()]
        what = f"; the file has: {'; '.join(found)}" if found else ""
        return MalformedFileError(f"has no lines that could be walls{what}")
