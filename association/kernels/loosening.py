"""Compiled comparison of an answer with its rivals where walls may be off by more: see `association.loosening`."""

import math

import numpy as np

from registration.allocating import zeros
from registration.compiling import kernel
from registration.layout import Floats, Records

from ..answering_tables import Answering
from ..layout import ESTIMATE, MATCH, MERIT, MODEL, TERMS, VARIANCES
from ..tables import Place, Question, Sights, Workspace
from ..tuning import LOOSE_BEAMS, LOOSE_FACTOR, LOOSE_RIVALS, LOOSE_WALLS, MODEL_OFFSET, TWIN_TEMPERATURE
from .features import by_segments
from .ranking import rank
from .scans import describe_view, set_map_sigma


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


@kernel
def loose_twin_share(question: Question, place: Place, work: Workspace, given: Answering) -> float:
    """Return the chance of the best explanation among its nearest rivals where walls may be off by more, up to 1."""
    told = given.told
    count = min(told.reached[0].explanations, LOOSE_RIVALS + 1)
    if given.known_walls.variance >= 0.0 or count == 1:
        return 1.0
    variances = zeros(1, VARIANCES)
    variances[0] = given.variances[0]
    terms = zeros(1, TERMS)
    terms[0] = question.terms[0]
    model = zeros(1, MODEL)
    model[0] = question.terms[0].model
    set_map_sigma(loose_sigma(math.sqrt(told.settled[0].wall_variance)), variances, model)
    terms[0].model.wall_variance = model[0].wall_variance
    _, rows, seen = describe_view(given.measured, given.counted, variances, model)
    loose = Question(rows, terms, question.rules)
    sights = Sights(given.sights.places, given.sights.starts, seen[: len(given.sights.seen)])
    estimates = zeros(count, ESTIMATE)
    values = zeros(count, np.float64)
    for k in range(count):
        estimates[k] = told.estimates[k]
        values[k] = told.merits[k].score
    again = zeros(count, MERIT)
    rank(loose, place, sights, estimates, again, zeros((count, len(rows)), MATCH), work)
    return loose_share(told.merits[:count], values, again)
