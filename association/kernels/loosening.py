"""Compiled comparison of an answer with its rivals where walls may be off by more: see `association.loosening`."""

import math

from registration.compiling import kernel
from registration.layout import Floats, Records

from ..tuning import LOOSE_BEAMS, LOOSE_FACTOR, LOOSE_WALLS, MODEL_OFFSET, TWIN_TEMPERATURE
from .features import by_segments


@kernel
def loose_sigma(wall_sigma: float) -> float:
    """Return by how much walls may be off beyond what every wall may be, metres, where they seem to be off by so much.

    A standard deviation.
    """
    loose = max(LOOSE_WALLS, LOOSE_FACTOR * wall_sigma)
    return math.sqrt(loose * loose - MODEL_OFFSET * MODEL_OFFSET)


@kernel
def loose_share(merits: Records, values: Floats, again: Records) -> float:
    """Return the chance of the first of some explanations among them, by what their segments score now, up to 1.

    `merits` (k,) of `MERIT` and `values` (k,), nats, are what they were worth; `again` (k,) of `MERIT` what their
    segments alone are now. What beams say of centimetres counts the less.
    """
    total = 0.0
    least = 0.0
    for k in range(len(merits)):
        merit = merits[k]
        by_beams = merit.score - by_segments(merit)
        worth = again[k].score + by_beams + values[k] - merit.score - (1.0 - LOOSE_BEAMS) * by_beams
        if k == 0:
            least = worth
        else:
            total += math.exp(min(0.0, worth - least) / TWIN_TEMPERATURE)
    return 1.0 / (1.0 + total)
