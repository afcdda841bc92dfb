"""The lines that segments lie on, and the lifetime of the elements of arrays of records."""

from __future__ import annotations

import math

from compiled import kernel

from ..layout import Floats, Records, X, Y

X2, Y2 = 2, 3  # columns of (n, 4) end points, behind `X` and `Y` of the begin


@kernel
def lines_of(
    endpoints: Floats, directions: Floats, normals: Floats, offsets: Floats, lengths: Floats, midpoints: Floats
) -> None:
    """Write of segments (n, 4) the directions and normals (n, 2), offsets and lengths (n,), and midpoints (n, 2)."""
    for i in range(len(endpoints)):
        along_x = endpoints[i, X2] - endpoints[i, X]
        along_y = endpoints[i, Y2] - endpoints[i, Y]
        length = math.hypot(along_x, along_y)
        # A segment without length is recognized by its length.
        dx = along_x / length if length > 0.0 else 0.0
        dy = along_y / length if length > 0.0 else 0.0
        x = endpoints[i, X] + 0.5 * along_x
        y = endpoints[i, Y] + 0.5 * along_y
        directions[i, X] = dx
        directions[i, Y] = dy
        normals[i, X] = -dy
        normals[i, Y] = dx
        # The offset at the midpoint: end points far from the origin round least there.
        offsets[i] = dx * y - dy * x
        lengths[i] = length
        midpoints[i, X] = x
        midpoints[i, Y] = y


@kernel
def keep_alive(records: Records) -> None:
    """Keep an array that a kernel made alive until here.

    An element, ``records[0]``, is a bare pointer. Numba frees an array after the last use of its name, although
    elements of it may be in use still: then others write to that memory. So a kernel that makes an array of records
    ends with this, unless it hands the array itself on or back. Arguments live as long as the call.
    """
