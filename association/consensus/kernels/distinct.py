"""Pick distinct poses."""

from __future__ import annotations

import numpy as np

from compiled import kernel
from registration.kernels import invert3
from registration.layout import SYMMETRIC3, Floats, Records

from ...layout import Integers
from .geometry import wrap


@kernel
def pick_distinct(
    poses: Records, values: Floats, most: int, distance: float, angle: float, same_family: float, better: float
) -> Integers:
    """Return the places of at most `most` poses without those that a better one stands for, the best first.

    A pose within a distance and an angle of a better one is the same; with `same_family` above 0 also one that is
    within so many squared deviations of it by its covariance, unless its value is more by `better`. Ties keep the
    earlier. Poses of value 0 are none.

    Parameters
    ----------
    poses : (k,) of `ESTIMATE`
    values : (k,)
    most : int
    distance, angle : float
        Metres, radians.
    same_family, better : float
        Squared deviations; nats.
    """
    order = np.argsort(-values, kind="mergesort")
    kept = np.empty(min(most, len(poses)), np.int64)
    informations = np.empty(len(kept), SYMMETRIC3)
    known = np.empty(len(kept), np.bool_)
    count = 0
    for place in range(len(order)):
        i = order[place]
        if count == len(kept) or values[i] <= 0.0:
            break
        same = False
        for k in range(count):
            x = poses[i].x - poses[kept[k]].x
            y = poses[i].y - poses[kept[k]].y
            turn = wrap(poses[i].theta - poses[kept[k]].theta)
            same = x * x + y * y < distance * distance and abs(turn) < angle
            if not same and known[k] and values[i] <= values[kept[k]] + better:
                f = informations[k]
                square = f.xx * x * x + f.yy * y * y + f.tt * turn * turn
                square += 2.0 * (f.xy * x * y + f.xt * x * turn + f.yt * y * turn)
                same = square < same_family
            if same:
                break
        if not same:
            kept[count] = i
            known[count] = same_family > 0.0 and invert3(poses[i], informations[count])
            count += 1
    return kept[:count]
