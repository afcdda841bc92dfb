"""Walls that are drawn by centre lines: their detection and thickness, and their outline: faces, and free ends."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from registration import Segments
from registration.layout import Floats

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

MOST_JOINED = 3000  # walls whose joints are worked out; of more only the faces are drawn
INSIDE = 1e-6  # m; what lies no deeper in another wall stays
LEAST_LEFT = 0.01  # m; shorter rests of a face are left out


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
    told = options.oriented is not None or bool(options.point) or drawing.format == "json"
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


def thickness_of(widths: Floats, drawing: Drawing) -> Floats:
    """Return how thick the walls of centre lines are: as the caller says, as the drawing does, or as walls usually are.

    Parameters
    ----------
    widths : (n,)
        Of the lines as they are drawn, metres; 0 where they have none.
    drawing : Drawing
        Its notes take which of these it is.
    """
    given, notes = drawing.options.thickness, drawing.notes
    if given is not None:
        notes.add_assumed("thickness_given", f"walls are {given:g} m thick, as the option thickness states")
        return np.full(len(widths), given)
    known = (widths >= THINNEST) & (widths <= THICKEST)
    if not known.any():
        told = f"walls are assumed {USUAL:g} m thick; a map check with scans estimates the thickness"
        notes.add_assumed("thickness_usual", told)
        return np.full(len(widths), USUAL)
    middle = float(np.median(widths[known]))
    told = f"walls are as thick as the drawn lines, with a median of {middle:.2g} m"
    if not known.all():
        told += f", which is assumed for {int((~known).sum())} lines without a width"
    notes.add_assumed("thickness_drawn", told)
    return np.where(known, widths, middle)


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


def outline(endpoints: Floats, thickness: Floats) -> Floats:
    """Return the faces of walls, free space on the left, as far as they do not lie within other walls.

    Ends that meet other walls are drawn on through them, ends that meet none are closed across.

    Parameters
    ----------
    endpoints : (n, 4)
        Centre lines, metres.
    thickness : (n,)
        Metres.

    Returns
    -------
    (m, 4)
    """
    lines = Segments.derived(endpoints)
    if len(lines) > MOST_JOINED or not thickness.all():
        return _faces(lines, thickness)
    reach = _reach(lines, thickness)
    d = np.hstack([-lines.directions * reach[:, :1], lines.directions * reach[:, 1:]])
    walls = Segments.derived(lines.endpoints + d)
    faces = _faces(walls, thickness)
    left, right = np.split(faces, 2)
    begins, ends = np.hstack([right[:, 2:], left[:, :2]]), np.hstack([left[:, 2:], right[:, :2]])
    every = np.vstack([faces, begins[reach[:, 0] == 0.0], ends[reach[:, 1] == 0.0]])
    return _outside(every, walls, thickness)


def _faces(lines: Segments, thickness: Floats) -> Floats:
    return np.vstack([one.moved_left(0.5 * thickness).endpoints for one in (lines, lines.reversed())])


def _reach(lines: Segments, thickness: Floats) -> Floats:
    """Return how far each wall runs on at its begin and its end, ``(n, 2)`` metres: through what it meets there."""
    reach = np.zeros((len(lines), 2))
    for low in range(0, len(lines), AT_ONCE):
        some = np.arange(low, min(low + AT_ONCE, len(lines)))
        for side, columns in enumerate((slice(0, 2), slice(2, 4))):
            along, off = in_frame(lines.endpoints[some, columns], lines.endpoints[:, :2], lines.directions)
            near = (np.abs(off) < MEETS) & (along > -MEETS) & (along < lines.lengths[:, None] + MEETS)
            near[some, np.arange(len(some))] = False
            # If another line continues straight, there is no corner to fill; it only is no free end.
            straight = (near & parallel_to(lines.directions, lines.directions[some])).any(axis=0)
            through = np.where(near, 0.5 * thickness[:, None], 0.0).max(axis=0)
            reach[some, side] = np.where(straight, INSIDE, through)
    return reach


def _outside(faces: Floats, walls: Segments, thickness: Floats) -> Floats:
    """Return what of faces lies within no wall; each is cut where it enters one and where it leaves it."""
    kept = []
    for low in range(0, len(faces), AT_ONCE):
        some = faces[low : low + AT_ONCE]
        enter, leave = _shares_within(some, walls, thickness)
        for face, begin, end in zip(some, enter.T, leave.T, strict=True):
            within = end > begin
            kept += _rests(face, begin[within], end[within])
    return np.array(kept).reshape(-1, 4)


def _shares_within(faces: Floats, walls: Segments, thickness: Floats) -> tuple[Floats, Floats]:
    """Return between which shares of its length each of k faces runs within each of n walls, ``(n, k)`` each."""
    enter, leave = np.zeros((len(walls), len(faces))), np.ones((len(walls), len(faces)))
    a0, o0 = in_frame(faces[:, :2], walls.endpoints[:, :2], walls.directions)
    a1, o1 = in_frame(faces[:, 2:], walls.endpoints[:, :2], walls.directions)
    half = 0.5 * thickness[:, None] - INSIDE
    limits = ((a0, a1, np.full_like(half, INSIDE), walls.lengths[:, None] - INSIDE), (o0, o1, -half, half))
    for first, last, low, high in limits:
        span = last - first
        flat = np.abs(span) < 1e-12
        safe = np.where(flat, 1.0, span)
        t0, t1 = (low - first) / safe, (high - first) / safe
        enter = np.maximum(enter, np.where(flat, 0.0, np.minimum(t0, t1)))
        beside = np.where((first > low) & (first < high), 1.0, -1.0)  # of what runs along: all of it, or nothing
        leave = np.minimum(leave, np.where(flat, beside, np.maximum(t0, t1)))
    return enter, leave


def _rests(face: Floats, begins: Floats, ends: Floats) -> list[Floats]:
    """Return what is left of a face without some shares of it."""
    span = face[2:] - face[:2]
    least = LEAST_LEFT / max(float(np.hypot(*span)), LEAST_LEFT)
    found, at = [], 0.0
    order = np.argsort(begins, kind="stable")
    for begin, end in [*zip(begins[order], ends[order], strict=True), (1.0, 1.0)]:
        if begin - at >= least:
            found.append(np.concatenate([face[:2] + at * span, face[:2] + begin * span]))
        at = max(at, float(end))
    return found
