"""A drawing as all readers give it: polylines in the drawing's own units."""

from __future__ import annotations

import fnmatch
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MalformedFileError, TooLargeError
from ..limits import MAX_SEGMENTS, MAX_UNITS
from ..report import Notes, shown

Floats = NDArray[np.float64]


@dataclass(slots=True)
class Drawing:
    """Polylines, y pointing up.

    Attributes
    ----------
    name : str
        Of the file, for errors and reports.
    format : str
    layers : tuple of str
        Patterns of the layers that are wanted; empty: all.
    notes : Notes
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
    segments : list of (k, 4)
        The lines so far, units of the drawing.
    widths : list of float
        Of each polyline, units of the drawing; 0 where it has none.
    layer_names : list of str
        Of each polyline; empty where it has none.
    """

    name: str
    format: str
    layers: tuple[str, ...]
    notes: Notes
    metres: float | None = None
    oriented: bool = False
    sigma: float | None = None
    frame_id: str = "map"
    meta: dict[str, str] = field(default_factory=dict)
    points: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    points_sigma: float | None = None
    segments: list[Floats] = field(default_factory=list)
    widths: list[float] = field(default_factory=list)
    layer_names: list[str] = field(default_factory=list)
    _count: int = 0

    def wants(self, *layers: str) -> bool:
        """Tell whether lines of a layer, or of one within others, are wanted."""
        if not self.layers:
            return True
        names = [layer.casefold() for layer in layers]
        return any(fnmatch.fnmatchcase(n, pattern.casefold()) for n in names for pattern in self.layers)

    def add(self, points: ArrayLike, *, closed: bool = False, width: float = 0.0, layer: str = "") -> None:
        """Add a polyline.

        Parameters
        ----------
        points : array-like of shape (n, 2)
            Units of the drawing.
        closed : bool
            True if a line runs from the last point to the first.
        width : float
            Units of the drawing.
        layer : str
            That it is on, for messages.

        Raises
        ------
        MalformedFileError
            When a coordinate is not a finite number, or too large for any unit.
        TooLargeError
            When the drawing has too many lines.
        """
        p = self._checked(points, 2)
        if closed and len(p) > 2 and not np.array_equal(p[0], p[-1]):
            p = np.vstack([p, p[:1]])
        if len(p) >= 2:
            self._keep(np.hstack([p[:-1], p[1:]]), width, layer)

    def add_segments(self, endpoints: ArrayLike) -> None:
        """Add lines of their own, ``(n, 4)`` units of the drawing; raises as `add` does."""
        self._keep(self._checked(endpoints, 4), 0.0, "")

    def _keep(self, endpoints: Floats, width: float, layer: str) -> None:
        self._count += len(endpoints)
        if self._count > MAX_SEGMENTS:
            raise TooLargeError(
                f"expected at most {MAX_SEGMENTS} lines, found {self._count} or more; select layers", argument=self.name
            )
        if len(endpoints):
            self.segments.append(endpoints)
            self.widths.append(width)
            self.layer_names.append(layer)

    def _checked(self, values: ArrayLike, columns: int) -> Floats:
        try:
            array = np.asarray(values, dtype=np.float64)
        except (TypeError, ValueError, OverflowError) as error:
            raise MalformedFileError(
                f"has a coordinate that is not a number up to {MAX_UNITS:g}: found text or a list", argument=self.name
            ) from error
        if array.size == 0:
            return np.zeros((0, columns))
        if array.ndim != 2 or array.shape[1] != columns or not (np.abs(array) <= MAX_UNITS).all():
            raise MalformedFileError(f"has a coordinate that is not a number up to {MAX_UNITS:g}", argument=self.name)
        return array

    @property
    def extent(self) -> str:
        """The extent of the lines, for messages, units of the drawing; empty where there are none."""
        if not self.segments:
            return ""
        corners = np.vstack(self.segments).reshape(-1, 2)
        (left, bottom), (right, top) = corners.min(axis=0), corners.max(axis=0)
        return f" from ({left:g}, {bottom:g}) to ({right:g}, {top:g})"

    def drop(self, kind: str, *, hint: str = "") -> None:
        """Note what is no wall or cannot be read, and what to do about it."""
        name = shown(kind)
        said = f"{name} is not read" + (f": it {hint}" if hint else "")
        self.notes.add_dropped(f"entity_{name.lower().replace(' ', '_')}", said, 1)

    def without_lines(self) -> MalformedFileError:
        """Return the error for a drawing without lines: it names what is there instead."""
        found = [f"{note.message} ({note.count})" for note in self.notes.dropped.values()]
        what = f"; the file has: {'; '.join(found)}" if found else ""
        return MalformedFileError(f"has no lines that could be walls{what}", argument=self.name)
