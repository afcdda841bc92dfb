"""Compute the features of the verdict; see `association.verdict.features.Features` for what each means."""

import math

from compiled import kernel
from registration.kernels import MAX_DEVIATION
from registration.layout import Records

from ...consensus.kernels.matching import part_of_match
from ..tuning import (
    CROWD_TEMPERATURE,
    FEW_WALLS,
    LEAST_CROWD,
    LEAST_MISFIT,
    LIKE_WALLS,
    LONGEST_UNMATCHED,
    MANY,
    MAX_LEAD,
    MOST_DEVIATION,
    MOST_MISFIT,
    MOST_UNMATCHED,
    NULL_FRACTION,
    OFFSET_OF_FEW,
)
from .alternatives import tempered_evidence
from .null_features import root_gap


@kernel
def describe(scores: Records, posterior: float, facts: Records, alternatives: Records, features: Records) -> None:
    """Write the features of an answer among its alternatives, with the least null score there is.

    `scores` (1,) of `SET_SCORE`, its `posterior`, and `facts` (1,) of `FACTS`; `alternatives` (k,) of `ALTERNATIVE`;
    `features` (1,) of `FEATURES`.
    """
    best = scores[0]
    fact = facts[0]
    out = features[0]
    lead = posterior if len(alternatives) == 0 else math.inf
    for k in range(len(alternatives)):
        lead = min(lead, -alternatives[k].gap)
    crowd = math.log(tempered_evidence(alternatives, CROWD_TEMPERATURE) + math.exp(LEAST_CROWD))
    misfit = math.log(min(MOST_MISFIT, max(LEAST_MISFIT, best.misfit)))
    out.constant = 1.0
    out.lead = min(lead, MAX_LEAD)
    out.solitude = -crowd
    out.inlier_fraction = best.fraction
    out.root_length = math.sqrt(best.length)
    out.deviation = min(fact.weakest, MOST_DEVIATION)
    out.misfit = misfit
    out.longest_unmatched = min(fact.longest, LONGEST_UNMATCHED)
    out.agreement = fact.agreement
    out.root_passed = math.sqrt(best.passed)
    out.root_farther = math.sqrt(fact.farther)
    out.root_nearer = math.sqrt(fact.nearer)
    out.root_passed_any = math.sqrt(fact.passed)
    out.critical_displacement = min(fact.critical_displacement, MOST_DEVIATION)
    out.critical_deviation = min(fact.critical_deviation, MOST_DEVIATION)
    out.null = NULL_FRACTION
    out.null_gap = root_gap((1.0 - NULL_FRACTION) * best.score)
    out.null_better = 0.0
    out.blocked = math.sqrt(best.blocked)
    out.walls = math.sqrt(fact.walls)
    out.misfit_of_many = misfit * min(best.count, MANY) / MANY
    out.root_unmatched_walls = math.sqrt(min(fact.unmatched_walls, MOST_UNMATCHED))
    out.squared_solitude = crowd * crowd


@kernel
def measure_unmatched(scan: Records, matches: Records, facts: Records) -> None:
    """Write the lengths of the scan lines that are not matched, metres, to `facts` (1,).

    These are the longest, and together those that are as long as walls.
    """
    fact = facts[0]
    fact.longest = 0.0
    fact.unmatched_walls = 0.0
    for i in range(len(scan)):
        left = (1.0 - part_of_match(matches[i])) * scan[i].length
        fact.longest = max(fact.longest, left)
        fact.unmatched_walls += left * like_wall(scan[i].length)


@kernel
def like_wall(length: float) -> float:
    """Return how far a scan line of a length, metres, counts as one of a wall, 0 to 1: furniture is shorter."""
    return min(1.0, max(0.0, (length - LIKE_WALLS[0]) / (LIKE_WALLS[1] - LIKE_WALLS[0])))


@kernel
def measure_leverages(leverages: Records, facts: Records) -> None:
    """Write to `facts` (1,) how many walls there are, and the worst pose without one of them."""
    fact = facts[0]
    fact.walls = 0.0
    fact.critical_displacement = 0.0
    fact.critical_deviation = 0.0
    for k in range(len(leverages)):
        fact.walls += leverages[k].own
        fact.critical_displacement = max(fact.critical_displacement, leverages[k].displacement)
        fact.critical_deviation = max(fact.critical_deviation, leverages[k].deviation)


@kernel
def depends_on_one_wall(facts: Records, matches: Records, with_beams: bool) -> bool:
    """Return whether so few walls fix the pose that one alone decides: any building has such a corner.

    Many have three sides of a room that are about as far apart, too, but few to millimetres. Beams move a pose to
    where those three fit, so that with them it proves less. `facts` (1,) of its leverages, see `measure_leverages`.
    """
    walls = facts[0].walls
    if walls >= FEW_WALLS + 0.5 or not facts[0].critical_deviation > MAX_DEVIATION:
        return False
    if walls < FEW_WALLS - 0.5 or with_beams:
        return True
    squares = 0.0
    count = 0
    for i in range(len(matches)):
        if matches[i].wall >= 0:
            squares += matches[i].offset ** 2
            count += 1
    return squares > count * OFFSET_OF_FEW**2
