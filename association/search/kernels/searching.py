"""Compiled search: the loop over bases, then parallel segments. It reads as `ransac_impl.h` of PoseLib does."""

import numpy as np

from compiled import kernel
from registration.layout import Records

from ...layout import FOUND, Integers
from ...tables import MapTables, Question, Workspace
from ..layout import BEST, EXHAUSTED, GOES_ON, INTERRUPTED
from ..tables import Plan, Sampling, SearchState
from ..tuning import BASE_SEGMENTS, KEPT_SLIDES, SLIDE_SEGMENTS
from .bases import next_base, plan_search
from .best_poses import best_first
from .hypotheses import search_base
from .sliding import search_slides, sliding_segments
from .stopping import missed_fraction, why_stop


@kernel
def search(
    question: Question,
    tables: MapTables,
    sampling: Sampling,
    limits: Records,
    statistics: Records,
    work: Workspace,
    stop: Integers,
) -> Records:
    """Search a map for the poses that explain a scan best, (k,) of `FOUND`, the best value first.

    1. Plan: pair up the bases, and prepare the stopping rule.
    2. Search bases until the stopping rule ends it.
    3. Slide parallel segments along the walls: those of a corridor make no base.

    Parameters
    ----------
    question : Question
        ``rules`` (2,) are those of bases and of slides.
    tables : MapTables
        Of the map.
    sampling : Sampling
        By which bases are drawn.
    limits : (1,) of `LIMITS`
    statistics : (1,) of `STATISTICS`
        Written.
    work : Workspace
    stop : (1,) uint8
        Not 0 once the search has to end; another thread may write it.
    """
    plan = plan_search(question, tables, sampling, statistics[0])
    state = SearchState(np.zeros(limits[0].stored, FOUND), np.zeros(1, BEST), statistics, stop)
    start_at(limits[0].known, 0.0, 0.0, state)
    statistics[0].why = search_bases(question, tables, plan, state, work, limits[0].allowed)
    slides = SearchState(np.zeros(KEPT_SLIDES, FOUND), np.zeros(1, BEST), statistics, stop)
    if statistics[0].why != INTERRUPTED:
        search_parallel(question, tables, state, slides, work, limits)
    return best_first(state, slides)


@kernel
def search_bases(
    question: Question, tables: MapTables, plan: Plan, state: SearchState, work: Workspace, allowed: float
) -> int:
    """Search bases, the best first, until the stopping rule ends it; return why it ended.

    1. Draw a base, the minimal sample.
    2. Form its hypotheses; score, refine and store each.
    3. Ask the stopping rule.
    """
    statistics = state.statistics[0]
    statistics.missed = 1.0 if len(plan.bases) > 0 else 0.0
    why = GOES_ON
    while why == GOES_ON:
        k = next_base(question, plan)
        if k < 0:
            why = EXHAUSTED
        elif not search_base(question, tables, plan.bases[k], state, work):
            why = INTERRUPTED
        else:
            statistics.bases += 1
            why = why_stop(question, plan, plan.bases[k], state, allowed)
    if why in (INTERRUPTED, EXHAUSTED) and len(plan.bases) > 0 and not plan.random:
        statistics.missed = missed_fraction(question, plan, state.best[0].best_value)
    return why


@kernel
def search_parallel(
    question: Question, tables: MapTables, of_bases: SearchState, slides: SearchState, work: Workspace, limits: Records
) -> None:
    """Lay the longest of parallel segments on every wall chain, where these may gain more than the best pose does.

    ``why`` of the statistics is then `INTERRUPTED` if the search has to end before the last slide.
    """
    scan = question.scan
    best = of_bases.best[0]
    start_at(best.best_value, best.least_value, best.least_freedom, slides)
    floor = limits[0].slides_fraction * best.best_value
    of_slides = Question(scan, question.terms, question.rules[1:])
    for a in sliding_segments(scan, min(len(scan), BASE_SEGMENTS), floor, SLIDE_SEGMENTS):
        if not search_slides(of_slides, tables, a, slides, work, limits[0].spacing):
            slides.statistics[0].why = INTERRUPTED
            return


@kernel
def start_at(best_value: float, least_value: float, least_freedom: float, state: SearchState) -> None:
    """Start a list of best poses, which is empty, at the values that another one has come to."""
    best = state.best[0]
    best.best_value = best_value
    best.least_value = least_value
    best.least_freedom = least_freedom
