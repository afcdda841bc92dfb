"""Grow and shrink the consensus set at a pose until both agree."""

import math

from compiled import kernel
from registration.layout import Record, Records

from ...scan.kernels.freedom import log_determinant
from ...tables import Place, Workspace
from ..tuning import ROUNDS
from .matching import allow_all, match_scan
from .pair_sums import clear_sums, empty_sums, update_pairs
from .reliability import fixes_pose, hold_along_walls
from .scoring import discount_steps, score_pairs, solve_pose
from .wall_errors import eliminate_wall_errors


@kernel
def refine(
    scan: Records, estimate: Record, place: Place, terms: Record, matches: Records, work: Workspace, floor: float
) -> float:
    """Refine a pose with its consensus set; return the score.

    1. Sum the pairs, and take the walls' own errors out.
    2. Solve for the pose.
    3. Match again at that pose; go on with 1 until no pair comes or goes, or `ROUNDS` are over.
    4. Drop the pairs that cost more than they gain, and score the others: see `score_set`.

    A set whose reliability does not fix a pose is a family: its pose stays where it is along the walls, which shows in
    the covariance. So does a direction that no pair fixes.

    Parameters
    ----------
    scan : (n,) of `SCAN_LINE`
    estimate : record of `ESTIMATE`
        Moves in place, with its covariance.
    place : Place
    terms : record of `TERMS`
    matches : (n,) of `MATCH`
        Come as those of `estimate`, by `match_scan`; hold the consensus set in the end.
    work : Workspace
        Its ``terms`` hold the terms of the score in the end, its ``sums`` the sums of the set.
    floor : float
        Nats; where the gains do not come to it the score is 0, and the rest is left undone.

    Returns
    -------
    float
        The score, nats, at least 0.
    """
    walls = place.walls
    scratch = work.scratch[0]
    sums = scratch.sums
    allow_all(scan, work.possible)
    empty_sums(work)
    clear_sums(sums)
    clear_terms(scratch.terms)
    discount_steps(scan, matches)
    changed = update_pairs(scan, matches, walls, work)
    rounds = 0
    while changed:
        eliminate_wall_errors(work, place.ties, terms.model.wall_variance)
        if sums.count == 0.0:
            return 0.0  # of pairs that came and went the sums keep rounding, which fixes nothing
        moved = solve_set(estimate, work)
        rounds += 1
        last = rounds == ROUNDS or not moved
        least = floor if last else 0.0
        if match_scan(scan, estimate, place, terms.gates, work.possible, least, matches) < 0.0:
            return 0.0
        discount_steps(scan, matches)
        changed = update_pairs(scan, matches, walls, work)
        if last:
            break
    return score_set(scan, estimate, place, terms.model, matches, work, floor, changed)


@kernel
def solve_set(estimate: Record, work: Workspace) -> bool:
    """Move a pose to the least chi-square of the set that is held, but along its walls if they do not fix it.

    Returns False where the pose would go too far, and stays.
    """
    scratch = work.scratch[0]
    x = estimate.x
    y = estimate.y
    moved = solve_pose(scratch.sums, estimate, scratch.information, scratch.terms)
    if scratch.terms.chi_square < math.inf and not fixes_pose(work):
        hold_along_walls(scratch.sums, x, y, estimate, scratch.terms)
    return moved


@kernel
def score_set(
    scan: Records,
    estimate: Record,
    place: Place,
    model: Record,
    matches: Records,
    work: Workspace,
    floor: float,
    changed: bool,
) -> float:
    """Drop the pairs that cost more than they gain, solve again, and score the set: see `refine`.

    The score is the gains less half of the chi-square, less the log-determinant of what the set fixes. `changed` is
    whether pairs came or went since the pose was solved for.
    """
    scratch = work.scratch[0]
    sums = scratch.sums
    terms = scratch.terms
    terms.gain = score_pairs(scan, estimate, place, model.wall_variance, matches, work)
    changed = update_pairs(scan, matches, place.walls, work) or changed
    if changed:
        eliminate_wall_errors(work, place.ties, model.wall_variance)
    if sums.count == 0.0 or terms.gain <= 0.0 or terms.gain < floor:
        return 0.0
    if changed or terms.chi_square == math.inf:
        solve_set(estimate, work)
    terms.log_determinant = log_determinant(scratch.information, model)
    return max(0.0, terms.gain - 0.5 * terms.chi_square - terms.log_determinant)


@kernel
def clear_terms(terms: Record) -> None:
    """Set the terms of a score to those of no pair."""
    terms.gain = 0.0
    terms.chi_square = 0.0
    terms.log_determinant = 0.0
