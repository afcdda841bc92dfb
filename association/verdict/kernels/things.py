"""Differences of evidence between two explanations, thing by thing."""

from __future__ import annotations

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Records

from ...index.kernels.walls import root_of
from ...scan.kernels.joining import ascending
from ..tuning import LEAST_OF_BEAM, OF_A_THING, THING_WIDTH, THINGS_APART


@kernel
def compare_things(values: Floats, distances: Floats, beams: Records) -> Floats:
    """Return by how much the first explanation has more evidence than each other, nats: the sum of all things.

    Places at which two explanations differ are one thing if they are no farther than `THINGS_APART` from one another.
    Of each `THING_WIDTH` of it a thing counts `OF_A_THING` at most.

    Parameters
    ----------
    values : (k, m)
        The evidence of each explanation at each place in view, nats.
    distances : (k, m)
        From the sensor to the thing that a value speaks of, metres.
    beams : (m,) of `BEAM`
        From where each place is seen, and its direction.
    """
    gaps = np.zeros(len(values) - 1)
    m = len(beams)
    x, y, more = np.empty(m), np.empty(m), np.empty(m)
    for other in range(1, len(values)):
        count = 0
        for i in range(m):
            differs = values[0, i] - values[other, i]
            if abs(differs) > LEAST_OF_BEAM:
                # A thing is where the map shows it to the explanation that it speaks against.
                away = distances[other, i] if differs > 0.0 else distances[0, i]
                x[count] = beams[i].x + away * beams[i].dx
                y[count] = beams[i].y + away * beams[i].dy
                more[count] = differs
                count += 1
        order = ascending(x[:count])
        thing = np.arange(count)
        for place in range(count):
            i = order[place]
            for later in range(place + 1, count):
                j = order[later]
                if x[j] - x[i] > THINGS_APART:
                    break
                # Most places of a band are too far along y, which costs less to find than a distance.
                if abs(y[j] - y[i]) <= THINGS_APART and math.hypot(x[j] - x[i], y[j] - y[i]) <= THINGS_APART:
                    one, another = root_of(thing, i), root_of(thing, j)
                    thing[max(one, another)] = min(one, another)
        low, high, total = np.full((count, 2), math.inf), np.full((count, 2), -math.inf), np.zeros(count)
        for i in range(count):
            one = thing[i] = root_of(thing, i)
            low[one, 0], high[one, 0] = min(low[one, 0], x[i]), max(high[one, 0], x[i])
            low[one, 1], high[one, 1] = min(low[one, 1], y[i]), max(high[one, 1], y[i])
            total[one] += more[i]
        for one in range(count):
            if thing[one] == one:
                width = math.hypot(high[one, 0] - low[one, 0], high[one, 1] - low[one, 1])
                most = OF_A_THING * max(1.0, width / THING_WIDTH)
                gaps[other - 1] += min(most, max(-most, total[one]))
    return gaps
