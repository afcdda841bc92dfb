"""The outline of walls that are drawn by their centre lines: faces, and ends where walls end freely."""

from __future__ import annotations

import numpy as np

from registration import Segments
from registration.layout import Floats

from .centre_lines import AT_ONCE, MEETS, in_frame, parallel_to

MOST_JOINED = 3000  # walls whose joints are worked out; of more only the faces are drawn
INSIDE = 1e-6  # m; what lies no deeper in another wall stays
LEAST_LEFT = 0.01  # m; shorter rests of a face are left out


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
