"""Compiled looks at a scan as it was sent: how wide it is, and which way its segments face."""

import math

from compiled import kernel
from registration.layout import Records


@kernel
def extent_along(ends: Records, directions: Records) -> float:
    """Return how wide segments lie apart in that of some directions in which that is most, metres; 0 without any.

    `ends` (n,) of `ENDS`, `directions` (k,) of `POINT`.
    """
    most = 0.0
    for k in range(len(directions)):
        dx = directions[k].x
        dy = directions[k].y
        low = 1e300
        high = -1e300
        for i in range(len(ends)):
            one = dx * ends[i].x1 + dy * ends[i].y1
            other = dx * ends[i].x2 + dy * ends[i].y2
            low = min(low, min(one, other))
            high = max(high, max(one, other))
        most = max(most, high - low)
    return most


@kernel
def facing_away(ends: Records, seen_from: Records, least: float) -> int:
    """Count the segments, (n,) of `ENDS`, that have the place they were seen from on their right, by over `least` m.

    `seen_from` (n,) of `POINT`, or (1,) where all were seen from there; nan where the place is unknown.
    """
    away = 0
    for i in range(len(ends)):
        place = seen_from[min(i, len(seen_from) - 1)]
        dx = ends[i].x2 - ends[i].x1
        dy = ends[i].y2 - ends[i].y1
        beside = dx * (place.y - 0.5 * (ends[i].y1 + ends[i].y2)) - dy * (place.x - 0.5 * (ends[i].x1 + ends[i].x2))
        if beside < -least * math.sqrt(dx * dx + dy * dy):
            away += 1
    return away
