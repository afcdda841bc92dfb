"""Detection of walls that are drawn by centre lines, and their thickness; positions of lines relative to each other."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration.layout import Floats

from ...options import ImportOptions
from ..drawing import Drawing

Flags = NDArray[np.bool_]

MOST_LINES = 3000  # that are compared with each other; larger drawings are taken for faces
FACE_APART = (0.03, 0.6)  # m; how far the other face of a wall lies
FEW_FACES = 0.15  # of the length; that has a second face next to it if walls are drawn by their centre lines
MOST_MEET = 0.5  # of the length; of lines that take part in a T or a crossing there
THINNEST, THICKEST = 0.03, 1.5  # m; a width that a wall may have, and no pen
# Between partitions and outer walls; measured for walls of 0.1 to 0.3 m.
USUAL = 0.2  # m
AT_ONCE = 200  # lines that are compared with all others at a time; memory
PARALLEL = math.sin(math.radians(3.0))
MEETS = 0.05  # m; an end as near to another line meets it


@dataclass(frozen=True, slots=True)
class Walls:
    """Thickness of the walls of centre lines, ``(n,)`` metres, and the note of the report."""

    thickness: Floats
    code: str
    told: str


def are_centres(endpoints: Floats, drawing: Drawing) -> bool:
    """Tell whether lines run in the middle of walls: as the caller says, or as they lie.

    Parameters
    ----------
    endpoints : (n, 4)
        Metres.
    drawing : Drawing
        Its notes take what was assumed.
    """
    options = drawing.options
    if options.drawn is not None:
        return options.drawn == "centres"
    told = options.oriented is not None or bool(options.point) or drawing.oriented or drawing.format == "json"
    if told or not 3 <= len(endpoints) <= MOST_LINES:
        return False
    lengths = np.hypot(*(endpoints[:, 2:] - endpoints[:, :2]).T)
    beside, meeting = _neighbours(endpoints, lengths)
    if beside.sum() > FEW_FACES * lengths.sum() or lengths[meeting].sum() < MOST_MEET * lengths.sum():
        return False
    drawing.notes.add_assumed(
        "centres",
        "lines are centre lines of walls, because their ends meet other lines and none has a parallel second face; "
        "set the option drawn to faces if they are faces",
        len(endpoints),
    )
    return True


def walls_of(widths: Floats, options: ImportOptions) -> Walls:
    """Return how thick the walls of centre lines are: as the caller says, as the drawing does, or as walls usually are.

    Parameters
    ----------
    widths : (n,)
        Of the lines as they are drawn, metres; 0 where they have none.
    options : ImportOptions
    """
    if options.thickness is not None:
        thickness = np.full(len(widths), options.thickness)
        return Walls(
            thickness, "thickness_given", f"walls are {options.thickness:g} m thick, as the option thickness states"
        )
    known = (widths >= THINNEST) & (widths <= THICKEST)
    if not known.any():
        told = f"walls are assumed {USUAL:g} m thick; a map check with scans estimates the thickness"
        return Walls(np.full(len(widths), USUAL), "thickness_usual", told)
    middle = float(np.median(widths[known]))
    told = f"walls are as thick as the drawn lines, with a median of {middle:.2g} m"
    if not known.all():
        told += f", which is assumed for {int((~known).sum())} lines without a width"
    return Walls(np.where(known, widths, middle), "thickness_drawn", told)


def _neighbours(endpoints: Floats, lengths: Floats) -> tuple[Floats, Flags]:
    """Return for each line the length with a parallel line next to it, metres, and whether it meets two arms or more.

    The end of a line is one arm, and its middle is two: at a corner two arms meet, at a T three.
    """
    d = (endpoints[:, 2:] - endpoints[:, :2]) / lengths[:, None]
    beside, meeting = np.zeros(len(lengths)), np.zeros(len(lengths), dtype=np.bool_)
    for low in range(0, len(lengths), AT_ONCE):
        some = np.arange(low, min(low + AT_ONCE, len(lengths)))
        own = some[:, None] == np.arange(len(lengths))
        a0, o0 = in_frame(endpoints[:, :2], endpoints[some, :2], d[some])
        a1, o1 = in_frame(endpoints[:, 2:], endpoints[some, :2], d[some])
        shared = np.minimum(lengths[some, None], np.maximum(a0, a1)) - np.maximum(0.0, np.minimum(a0, a1))
        apart = 0.5 * np.abs(o0 + o1)
        other_face = parallel_to(d[some], d) & ~own & (shared > 0.0) & (apart > FACE_APART[0]) & (apart < FACE_APART[1])
        beside[some] = np.minimum(lengths[some], np.where(other_face, shared, 0.0).sum(axis=1))
        for place in (endpoints[some, :2], endpoints[some, 2:]):
            arms = _arms(place, endpoints[:, :2], d, lengths) * ~own
            tees = arms.sum(axis=1) >= 2
            meeting[some[tees]] = True
            meeting |= (arms[tees] > 0).any(axis=0)
    return beside, meeting


def _arms(places: Floats, begins: Floats, d: Floats, lengths: Floats) -> NDArray[np.int64]:
    """Return how many arms each of n lines has at each of k places, ``(k, n)``: 0, 1 at its end, 2 in its middle."""
    x = places[:, None, 0] - begins[None, :, 0]
    y = places[:, None, 1] - begins[None, :, 1]
    along, off = x * d[:, 0] + y * d[:, 1], np.abs(d[:, 0] * y - d[:, 1] * x)
    on = (off < MEETS) & (along > -MEETS) & (along < lengths + MEETS)
    middle = (along > MEETS) & (along < lengths - MEETS)
    return np.where(on, np.where(middle, 2, 1), 0)


def in_frame(points: Floats, origins: Floats, d: Floats) -> tuple[Floats, Floats]:
    """Return where n points lie along and to the left of k lines, ``(k, n)`` each, metres."""
    x = points[None, :, 0] - origins[:, None, 0]
    y = points[None, :, 1] - origins[:, None, 1]
    return d[:, :1] * x + d[:, 1:] * y, d[:, :1] * y - d[:, 1:] * x


def parallel_to(some: Floats, others: Floats) -> Flags:
    """Tell which of n directions are those of k lines, either way round, ``(k, n)``."""
    found: Flags = np.abs(some[:, :1] * others[None, :, 1] - some[:, 1:] * others[None, :, 0]) < PARALLEL
    return found
