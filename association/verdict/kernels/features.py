"""Compiled numbers that the verdict goes by: see `association.verdict.features`."""

import math

from compiled import kernel
from registration.kernels import MAX_DEVIATION
from registration.layout import Record, Records

from ...consensus.kernels.matching import part_of_match
from ...tuning import (
    BEAMS_PASSED,
    BEAMS_READ,
    CROWD_TEMPERATURE,
    FEW_WALLS,
    LEAST_CHANCE_FEATURE,
    LEAST_CROWD,
    LEAST_MISFIT,
    LONGEST_UNMATCHED,
    MANY,
    MAX_LEAD,
    MOST_DEVIATION,
    MOST_MISFIT,
    MOST_UNMATCHED,
    NEARLY_ALL,
    NULL_SHARE,
    OFFSET_OF_FEW,
    RIVAL_SHARE,
    TWIN_TEMPERATURE,
    UNCOUNTED_SHARE,
    USUAL_WALLS,
)
from .odds import root_gap, share_between


@kernel
def by_segments(merit: Record) -> float:
    """Return a score without the beams' part, nats."""
    return merit.score - BEAMS_READ * merit.read + BEAMS_PASSED * merit.passed


@kernel
def worth(one: Record) -> float:
    """Return what an explanation, a record of `RIVAL`, is worth where nobody knows how far the walls are off, nats.

    The value takes half the cost, the likelihood of its residuals where walls are off by `MODEL_OFFSET`. Of n matches
    with an unknown variance, which `USUAL_WALLS` (k) before are taken to have shown to be as much, the likelihood is
    Student's t: ``log G((n + k) / 2) - log G(k / 2) - n / 2 log(k / 2) - (n + k) / 2 log(1 + cost / k)``. Where the
    walls of a map are off by more, the centimetres that tell rivals apart count that much less.
    """
    n = one.count
    k = USUAL_WALLS
    student = math.lgamma(0.5 * (n + k)) - math.lgamma(0.5 * k) - 0.5 * n * math.log(0.5 * k)
    student -= 0.5 * (n + k) * math.log1p(one.cost / k)
    return one.value + 0.5 * one.cost + student


@kernel
def weigh(explanations: Records, weighed: Records) -> None:
    """Weigh the rivals of the first of some explanations, (k + 1,) of `RIVAL`; writes (k,) of `WEIGHED`."""
    best = explanations[0]
    least = worth(best)
    for k in range(len(weighed)):
        rival = explanations[k + 1]
        share = rival.value / best.value if best.value > 0.0 else 1.0
        weighed[k].gap = worth(rival) - least
        weighed[k].counted = share_between(share, UNCOUNTED_SHARE, RIVAL_SHARE)


@kernel
def evidence(weighed: Records, temperature: float) -> float:
    """Return what rivals weigh beside the best, each at most 1."""
    total = 0.0
    for k in range(len(weighed)):
        total += weighed[k].counted * math.exp(min(0.0, weighed[k].gap) / temperature)
    return total


@kernel
def twin_share(weighed: Records) -> float:
    """Return the chance of the best explanation among its rivals that are about as good, above 0 and up to 1."""
    return 1.0 / (1.0 + evidence(weighed, TWIN_TEMPERATURE))


@kernel
def describe(merits: Records, value: float, facts: Records, weighed: Records, features: Records) -> None:
    """Write the features of an answer beside its rivals, with the least null there is.

    `merits` (1,) of `MERIT`, its `value`, and `facts` (1,) of `FACTS`; `weighed` (k,); `features` (1,) of `FEATURES`.
    """
    merit = merits[0]
    fact = facts[0]
    out = features[0]
    lead = value if len(weighed) == 0 else math.inf
    for k in range(len(weighed)):
        lead = min(lead, -weighed[k].gap)
    crowd = math.log(evidence(weighed, CROWD_TEMPERATURE) + math.exp(LEAST_CROWD))
    misfit = math.log(min(MOST_MISFIT, max(LEAST_MISFIT, merit.misfit)))
    out.constant = 1.0
    out.lead = min(lead, MAX_LEAD)
    out.solitude = -crowd
    out.share = merit.share
    out.root_count = math.sqrt(merit.count)
    out.root_length = math.sqrt(merit.length)
    out.deviation = min(fact.weakest, MOST_DEVIATION)
    out.misfit = misfit
    out.inverse_count = 1.0 / max(1.0, merit.count)
    out.longest_unmatched = min(fact.longest, LONGEST_UNMATCHED)
    out.agreement = fact.agreement
    out.read = merit.read
    out.passed = merit.passed
    out.root_farther = math.sqrt(fact.farther)
    out.root_nearer = math.sqrt(fact.nearer)
    out.hinge_moves = min(fact.moves, MOST_DEVIATION)
    out.hinge_deviation = min(fact.hinge_deviation, MOST_DEVIATION)
    out.chance = max(LEAST_CHANCE_FEATURE, math.log10(fact.significance))
    out.null = NULL_SHARE
    out.null_gap = root_gap((1.0 - NULL_SHARE) * merit.score)
    out.null_better = 0.0
    out.root_score = math.sqrt(max(0.0, by_segments(merit)))
    out.blocked = math.sqrt(merit.blocked)
    out.walls = math.sqrt(fact.walls)
    out.misfit_of_many = misfit * min(merit.count, MANY) / MANY
    out.beyond_nearly_all = max(0.0, merit.share - NEARLY_ALL)
    out.root_unmatched = math.sqrt(min(fact.unmatched, MOST_UNMATCHED))
    out.squared_solitude = crowd * crowd


@kernel
def see_unmatched(scan: Records, matches: Records, facts: Records) -> None:
    """Write to `facts` (1,) how long the longest scan line that is not matched is, and all of them together, metres."""
    fact = facts[0]
    fact.longest = 0.0
    fact.unmatched = 0.0
    for i in range(len(scan)):
        left = (1.0 - part_of_match(matches[i])) * scan[i].length
        fact.longest = max(fact.longest, left)
        fact.unmatched += left


@kernel
def see_hinges(hinges: Records, facts: Records) -> None:
    """Write to `facts` (1,) how many walls there are, and what the pose comes to at worst without one of them."""
    fact = facts[0]
    fact.walls = 0.0
    fact.moves = 0.0
    fact.hinge_deviation = 0.0
    for k in range(len(hinges)):
        fact.walls += hinges[k].own
        fact.moves = max(fact.moves, hinges[k].moves)
        fact.hinge_deviation = max(fact.hinge_deviation, hinges[k].deviation)


@kernel
def is_thin(facts: Records, matches: Records, with_beams: bool) -> bool:
    """Tell whether so few walls fix the pose that one alone decides: any building has such a corner.

    Many have three sides of a room that are about as far apart, too, but few to millimetres. Beams move a pose to
    where those three fit, so that with them it proves less. `facts` (1,) of its hinges, as `see_hinges` writes them.
    """
    walls = facts[0].walls
    if walls >= FEW_WALLS + 0.5 or not facts[0].hinge_deviation > MAX_DEVIATION:
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
