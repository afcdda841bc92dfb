"""Compiled search of the mirrored scan, as `association.null` does it in steps."""

from registration.allocating import zeros
from registration.compiling import inlined, kernel
from registration.kernels import keep_alive
from registration.layout import Records

from ..answering_tables import Answering
from ..layout import ESTIMATE, FOUND, HOW, MATCH, MERIT, POINT, PROGRESS, RULES
from ..planning_tables import Planning
from ..tables import MapTables, Question, Sights, Workspace
from ..tuning import KEPT_SLIDES, NULL_ALLOWED, NULL_ALLOWED_NEAR, NULL_ENOUGH, NULL_KEPT, NULL_MARGIN, NULL_SHARE
from .features import by_segments
from .odds import chance, take_null
from .ranking import begin_at, rank
from .scans import mirror_lines
from .searching import search
from .symmetry import mirrored_share


@inlined
def compare_with_null(
    question: Question,
    tables: MapTables,
    planning: Planning,
    work: Workspace,
    how: Records,
    given: Answering,
    share: float,
) -> bool:
    """Write what the mirrored scan comes to into features and chances, as `association.null` works it out.

    Where it comes to less than `share` of the answer's score it may be told to be none. False where that takes longer
    than the budget lets it.
    """
    told = given.told
    score = told.merits[0].score
    rows, seen = mirror_lines(question.scan)
    places = zeros(len(given.sights.places), POINT)
    for v in range(len(places)):
        places[v].x = given.sights.places[v].x
        places[v].y = -given.sights.places[v].y
    sights = Sights(places, given.sights.starts, seen[: len(given.sights.seen)])
    plans = Planning(planning.runs, planning.area, given.orders, given.ranks, planning.fade, planning.noise)
    other = Question(rows, question.terms, zeros(2, RULES))
    limits = zeros(1, HOW)
    null = zeros(1, ESTIMATE)
    for k in range(2):
        other.rules[k] = question.rules[k]
    limits[0] = how[0]
    known = max(0.0, by_segments(told.merits[0]))
    wanted = share * score
    least = NULL_MARGIN * wanted / known if known > 0.0 else 0.0
    if least > NULL_SHARE:
        look_for(least, max(how[0].allowed, NULL_ALLOWED_NEAR), known, other.rules, limits)
        near = best_of(other, tables, plans, sights, work, limits, known, null)
        if near < wanted:
            write_null(given, 0.0, 0.0)
            return near >= 0.0
    look_for(NULL_SHARE, max(how[0].allowed, NULL_ALLOWED), known, other.rules, limits)
    reached = best_of(other, tables, plans, sights, work, limits, known, null)
    symmetry = 0.0
    if reached > 0.0:
        views, poses = given.sights.places, told.estimates[:1]
        symmetry = mirrored_share(views, given.seen, poses, null, given.gates, tables.place, work)
    write_null(given, reached, symmetry)
    return reached >= 0.0


@kernel
def write_null(given: Answering, score: float, symmetry: float) -> None:
    """Write what the mirrored scan scores into features and chances."""
    told = given.told
    take_null(told.merits[0].score, score, symmetry, told.features)
    told.chances[0].careful = chance(given.cautious, told.features) * told.chances[0].share


@kernel
def look_for(share: float, allowed: float, known: float, rules: Records, limits: Records) -> None:
    """Write that only what comes to such a share of what is `known`, nats, is looked for.

    To `rules` (2,) of `RULES` and `limits` (1,) of `HOW`.
    """
    for k in range(2):
        rules[k].kept_share = share
        rules[k].rival_share = share
        rules[k].enough = NULL_ENOUGH * known
    limits[0].allowed = allowed
    limits[0].share = share
    limits[0].kept = NULL_KEPT


@inlined
def best_of(
    question: Question,
    tables: MapTables,
    planning: Planning,
    sights: Sights,
    work: Workspace,
    how: Records,
    known: float,
    best: Records,
) -> float:
    """Search; return the score of the best explanation, which is written to `best` (1,) of `ESTIMATE`.

    0 where there is none, -1 where the budget ended the search.
    """
    found = zeros(NULL_KEPT + KEPT_SLIDES, FOUND)
    progress = zeros(1, PROGRESS)
    progress[0].best_value = known
    _, plan = search(question, tables, planning, found, progress, work, how)
    poses = found[: progress[0].count]
    if plan is not None:
        return -1.0
    estimates = zeros(len(poses), ESTIMATE)
    merits = zeros(len(poses), MERIT)
    begin_at(poses, estimates)
    rank(question, tables.place, sights, estimates, merits, zeros((len(poses), len(question.scan)), MATCH), work)
    score = 0.0
    for k in range(len(poses)):
        if merits[k].score > score:
            score = max(score, merits[k].score)
            best[0] = estimates[k]
    keep_alive(progress)
    keep_alive(estimates)
    keep_alive(merits)
    return score
