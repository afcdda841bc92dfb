"""Ray casting.

Nothing here validates: callers pass finite numbers. The kernel has a slow reference in
``tests/simulation/test_simulation.py``.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from compiled import kernel
from registration.kernels import keep_alive
from registration.layout import SEGMENT, Floats

# rad; a ray this close to an end still meets the segment, so that none slips through the joint of two walls.
END_TOLERANCE = 1e-12

# Of two faces of one thin wall the one that looks at the sensor is the one that is hit.
BACK_FACE_HANDICAP = 1.0 + 1e-9


@kernel
def cast(
    endpoints: Floats,
    x: float,
    y: float,
    start: float,
    increment: float,
    cosines: Floats,
    sines: Floats,
    one_sided: bool,
) -> tuple[Floats, NDArray[np.int64]]:
    """Intersect the beams from ``(x, y)`` with n segments, each over the beams that it subtends.

    Parameters are the ``(n, 4)`` endpoints, the sensor's place, the first beam's angle and the step from beam to beam
    in the segments' frame, and the ``(m,)`` direction cosines of the beams. With `one_sided` a segment stops only
    beams that come from its left. Returns ``(m,)`` ranges, inf where nothing is hit, and the segments' indices, -1
    there.
    """
    segments = endpoints.reshape(-1).view(SEGMENT)
    beams = len(cosines)
    ranges = np.full(beams, np.inf)
    keys = np.full(beams, np.inf)
    hits = np.full(beams, -1, dtype=np.int64)
    step = abs(increment)
    for k in range(len(segments)):
        bx = segments[k].begin_x - x
        by = segments[k].begin_y - y
        ex = segments[k].end_x - x
        ey = segments[k].end_y - y
        nx = by - ey
        ny = ex - bx
        p = nx * bx + ny * by
        facing = p < 0.0
        if p == 0.0 or (one_sided and not facing):
            continue
        turn = math.atan2(bx * ey - by * ex, bx * ex + by * ey)
        # The angle of the end that the beams meet first, counted from the first beam in the sense of the scan.
        if increment > 0.0:
            low = math.atan2(by, bx) + min(turn, 0.0) - start
        else:
            low = start - math.atan2(by, bx) - max(turn, 0.0)
        low = (low - END_TOLERANCE) % math.tau
        width = abs(turn) + 2.0 * END_TOLERANCE
        for lap in range(-1, 2):
            near = low + lap * math.tau
            first = max(0, math.ceil(near / step))
            last = min(beams - 1, math.floor((near + width) / step))
            for i in range(first, last + 1):
                slant = nx * cosines[i] + ny * sines[i]
                if slant == 0.0:
                    continue
                r = p / slant
                key = r if facing else r * BACK_FACE_HANDICAP
                if r > 0.0 and key < keys[i]:
                    keys[i] = key
                    ranges[i] = r
                    hits[i] = k
    keep_alive(segments)
    return ranges, hits
