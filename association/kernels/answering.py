"""Compiled answer: searched, explained and judged in one call, as `association.explain` and `.verdict` do it in steps.

Of a scan from one place without beams and without a prior. What takes long, or has to be looked at otherwise, is left
to those: a search that its budget ended, a map that may not be to scale.
"""

import math

import numpy as np

from registration.allocating import zeros
from registration.compiling import internal, kernel
from registration.kernels import MAX_DEVIATION, keep_alive
from registration.layout import Records

from ..answering_tables import Answering, Told
from ..layout import ESTIMATE, EXPLAINED, FEATURES, JUDGED, MATCH, MERIT, RIVAL, WEIGHED, Integers
from ..planning_tables import Plan, Planning
from ..tables import MapTables, Place, Question, Workspace
from ..tuning import (
    CONTRADICTION,
    DISTINCT_ANGLE,
    DISTINCT_DISTANCE,
    LEAST_OFF_WALLS,
    NEUTRAL,
    SAME_FAMILY,
    USABLE_CAUTIOUS,
    USABLE_PROBABILITY,
)
from .agreement import agreement
from .chance import significance, worth_of
from .features import describe, is_thin, see_hinges, see_unmatched, twin_share, weigh
from .loosening import loose_twin_share
from .null import compare_with_null
from .odds import allowed_null, three_chances
from .ranking import begin_at, distinct, rank
from .searching import search
from .settling import settle
from .similarity import is_off, pose_of_similarity, settle_similarity


@internal
@kernel
def answer(
    question: Question,
    tables: MapTables,
    planning: Planning,
    found: Records,
    progress: Records,
    work: Workspace,
    how: Records,
    given: Answering,
) -> tuple[int, Plan | None]:
    """Search as `search` does, and go on with what was found; writes to ``told`` of `given` as far as it comes.

    Where that has no room for how far that is, the search is all that is asked.
    """
    why, plan = search(question, tables, planning, found, progress, work, how)
    if plan is not None or len(given.told.reached) == 0:
        return why, plan
    explain(question, tables.place, found[: progress[0].count], work, given)
    reached = given.told.reached[0]
    if reached.explanations == 0 or may_be_off(question, work, given):
        return why, plan
    share = judge(question, tables.place, work, given)
    if share < 0.0 or compare_with_null(question, tables, planning, work, how, given, share):
        reached.stage = JUDGED
    return why, plan


@kernel
def explain(question: Question, place: Place, found: Records, work: Workspace, given: Answering) -> None:
    """Rank what was found, (k,) of `FOUND`, tell apart what is distinct, and settle the best of it."""
    told = given.told
    n = len(question.scan)
    estimates = zeros(len(found), ESTIMATE)
    merits = zeros(len(found), MERIT)
    matches = zeros((len(found), n), MATCH)
    begin_at(found, estimates)
    rank(question, place, given.sights, estimates, merits, matches, work)
    most, none = len(told.estimates), zeros(0, np.float64)
    order = distinct(estimates, merits, none, most, DISTINCT_DISTANCE, DISTINCT_ANGLE, SAME_FAMILY, CONTRADICTION)
    tell(told, order, estimates, merits, matches)
    reached = told.reached[0]
    reached.stage = EXPLAINED
    reached.explanations = len(order)
    reached.walls = 0
    if len(order) > 0:
        best = told.estimates[:1]
        reached.walls = settle(question, given.known_walls, told.matches[:1], best, told.settled, told.hinges, work)
        fact = told.facts[0]
        fact.farther = 0.0
        fact.nearer = 0.0
        fact.agreement = agreement(given.sights, best, place, work) if len(given.sights.seen) > 0 else NEUTRAL
        score = worth_of(told.matches[0])
        fact.significance = significance(question.scan, given.lengths, given.gates, given.exponents, score)


@kernel
def tell(told: Told, order: Integers, estimates: Records, merits: Records, matches: Records) -> None:
    """Write explanations in an order."""
    for k in range(len(order)):
        told.estimates[k] = estimates[order[k]]
        told.merits[k] = merits[order[k]]
        for i in range(matches.shape[1]):
            told.matches[k, i] = matches[order[k], i]


@kernel
def may_be_off(question: Question, work: Workspace, given: Answering) -> bool:
    """Tell whether the best explanation says that the scan is not to scale: see `association.to_scale`."""
    told = given.told
    if not given.to_scale or math.sqrt(told.settled[0].wall_variance) < LEAST_OFF_WALLS:
        return False
    solution = zeros(4, np.float64)
    covariance = zeros((4, 4), np.float64)
    pose = zeros(1, ESTIMATE)
    walls = given.known_walls.walls
    variance, _ = settle_similarity(question, walls, told.matches[0], solution, covariance, work)
    if variance < 0.0:
        return False
    factor, spread = pose_of_similarity(solution, covariance, pose[0])
    keep_alive(pose)
    return is_off(factor, math.sqrt(spread))


@kernel
def judge(question: Question, place: Place, work: Workspace, given: Answering) -> float:
    """Work out the chances of the best explanation before it is compared with its null.

    Returns what share of its score the null may come to and be told to be none; -1 where nobody asks for it.
    """
    told = given.told
    out = told.chances[0]
    settled = told.settled[0]
    weighed = beside(told.merits[: told.reached[0].explanations])
    features = told.features
    fact = told.facts[0]
    fact.weakest = settled.weakest
    see_hinges(told.hinges[: told.reached[0].walls], told.facts)
    see_unmatched(question.scan, told.matches[0], told.facts)
    describe(told.merits[:1], told.merits[0].score, told.facts, weighed, features)
    share = twin_share(weighed)
    right, careful, explained = three_chances(given.usual, given.cautious, features, given.usual_deviation)
    thin = is_thin(told.facts, told.matches[0], False)
    free = settled.parallel or settled.weakest > MAX_DEVIATION
    asking = right * share >= USABLE_PROBABILITY and not free and not thin
    if asking and careful * share >= USABLE_CAUTIOUS:
        share = min(share, loose_twin_share(question, place, work, given))
    out.right = right * share
    out.careful = careful * share
    out.explained = explained
    out.share = share
    out.thin = thin
    if not asking or out.careful < USABLE_CAUTIOUS:
        return -1.0
    if out.right < USABLE_PROBABILITY:
        return 0.0
    tried = zeros(1, FEATURES)
    tried[0] = features[0]
    return allowed_null(given.cautious, tried, told.merits[0].score, USABLE_CAUTIOUS / share)


@kernel
def beside(merits: Records) -> Records:
    """Weigh explanations, (k + 1,) of `MERIT`, beside the first of them, without a prior: (k,) of `WEIGHED`."""
    explanations = zeros(len(merits), RIVAL)
    weighed = zeros(len(merits) - 1, WEIGHED)
    for k in range(len(merits)):
        explanations[k].value = merits[k].score
        explanations[k].cost = merits[k].cost
        explanations[k].count = merits[k].count
    weigh(explanations, weighed)
    return weighed
