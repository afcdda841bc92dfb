"""The answer as a caller gets it: the pose with its correspondences, diagnostics and warnings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from registration import Ambiguity

from .consensus.acceptance import accept, correspondences, register_accepted
from .consensus.beams import cast
from .consensus.consensus_set import ConsensusSet
from .consensus.kernels.rays import passed_walls
from .consensus.tuning import BLOCKING_RAYS
from .context import SearchContext
from .explanations import Answer, Explanations
from .result import (
    Alternative,
    AssociationDiagnostics,
    AssociationResult,
    Corrections,
    Correspondence,
    CriticalWall,
    Status,
)
from .tuning import CRITICAL_DISPLACEMENT
from .verdict.verdict import Verdict
from .warnings import warnings_of, warnings_of_map


def report(context: SearchContext, explanations: Explanations, verdict: Verdict) -> AssociationResult:
    """Put an answer together of a search and the verdict on it."""
    answer = None if verdict.status is Status.NO_MATCH else explanations.answer
    others = explanations.ranked if answer is None else tuple(explanations.others)
    alternatives = _alternatives(context, explanations, others, verdict)
    missing = () if answer is None else _missing_map(context, answer)
    if context.deadline.passed:
        verdict = verdict.cut_short()
    search = explanations.search if verdict.complete else explanations.search.cut_short()
    found = AssociationResult(
        status=verdict.status,
        usable=verdict.usable,
        probability=verdict.probability if answer is not None else 0.0,
        unmatched_scan=tuple(range(len(context.scan.measured))),
        reasons=verdict.reasons,
        alternatives=alternatives,
        search=search,
        warnings=warnings_of(context, search, verdict),
        frame_id=context.index.frame_id,
        child_frame_id=context.scan.frame_id,
        stamp=context.scan.stamp,
    )
    if answer is None:
        return found
    degenerate, include = verdict.status is Status.DEGENERATE, context.options.include
    matched, on_map = set(answer.accepted.scan_indices), set(answer.accepted.map_indices(context.index))
    return replace(
        found,
        pose=verdict.pose,
        covariance=None if degenerate or context.options.estimator == "one_step" else answer.covariance,
        unobservable=answer.estimate.direction if degenerate else None,
        correspondences=_correspondences(context, answer, verdict) if "correspondences" in include else (),
        unmatched_scan=tuple(i for i in range(len(context.scan.measured)) if i not in matched),
        missing_map=tuple(i for i in missing if i not in on_map),
        diagnostics=_diagnostics(context, explanations, answer, verdict),
        warnings=(*found.warnings, *warnings_of_map(context, explanations, answer)),
    )


def _correspondences(context: SearchContext, answer: Answer, verdict: Verdict) -> tuple[Correspondence, ...]:
    """Return the consensus set, with the overlaps at the pose that is answered."""
    assert verdict.pose is not None
    there = accept(context, answer.best, context.in_index(verdict.pose))
    overlaps = dict(zip(there.scan_indices, there.overlaps.tolist(), strict=True))
    own = np.array([overlaps.get(i, 0.0) for i in answer.accepted.scan_indices])
    return correspondences(context.index, replace(answer.accepted, overlaps=own), answer.registered)


def _diagnostics(
    context: SearchContext, explanations: Explanations, answer: Answer, verdict: Verdict
) -> AssociationDiagnostics:
    best, nearest = answer.best, next((one for one in explanations.others if one.inside), None)
    margin = runner_up = None
    if nearest is not None:
        margin = max(0.0, best.posterior - nearest.posterior)
        runner_up = max(0.0, nearest.posterior / best.posterior) if best.posterior > 0.0 else None
    fit = answer.registered.diagnostics
    turn, seconds = explanations.shown_turn, context.scan.sweep_s
    return AssociationDiagnostics(
        **{one.name: getattr(fit, one.name) for one in fields(fit)},
        inlier_fraction=best.fraction(context.lines.rows),
        score=best.score,
        runner_up=runner_up,
        margin=margin,
        critical_wall=_critical_wall(context, answer),
        corrections=corrections_of(explanations, answer),
        turn_rate=turn / seconds if turn and seconds else None,
    )


def corrections_of(explanations: Explanations, answer: Answer) -> Corrections | None:
    """Return what the pose was estimated together with; None where that is the pose alone."""
    found = answer.estimate
    if not found.with_columns and explanations.scale == 1.0:
        return None
    xx, yy, xy = found.strain[0].tolist()
    return Corrections(explanations.scale, found.offset[0], (xx, yy, xy))


def _critical_wall(context: SearchContext, answer: Answer) -> CriticalWall | None:
    """Return the wall without which the pose would move most or be free; None where it would hardly move."""
    found = answer.estimate.leverages
    moves = np.maximum(found.displacements, found.deviations)
    worst = int(moves.argmax())
    if moves[worst] < CRITICAL_DISPLACEMENT:
        return None
    walls = answer.best.matches["wall"][context.lines.row_of[answer.accepted.pairs[:, 0]]]
    on_it = context.index.is_one_wall(walls, int(found.walls[worst]))
    scan = tuple(map(int, answer.accepted.pairs[on_it, 0]))
    on_map = sorted({i for i, there in zip(answer.accepted.map_indices(context.index), on_it, strict=True) if there})
    dx, dy = found.directions[worst].tolist()
    return CriticalWall(scan, tuple(on_map), (dx, dy), float(moves[worst]))


def _missing_map(context: SearchContext, answer: Answer) -> tuple[int, ...]:
    """List the map segments of walls that rays to the consensus set pass through, and that hold none of it."""
    if "missing_map" not in context.options.include or context.too_late_to_look:
        return ()
    index, matched = context.index, answer.best.matched
    rays = context.rays_to_lines
    table = cast(context, rays, answer.best.estimate)
    _, walls, to_matched, _ = passed_walls(rays.rows, rays.line, rays.sensor, table, answer.best.matches[None])
    own = set(answer.best.matches["wall"][matched].tolist())
    missing: set[int] = set()
    for wall in walls[2.0 * to_matched >= BLOCKING_RAYS].tolist():
        if wall not in own and wall < len(index.walls.rows):
            pieces = index.pieces.items[index.pieces.starts[wall] : index.pieces.starts[wall + 1]]
            missing.update((pieces % index.directed).tolist())
    return tuple(sorted(missing))


def _alternatives(
    context: SearchContext, explanations: Explanations, others: Sequence[ConsensusSet], verdict: Verdict
) -> tuple[Alternative, ...]:
    if verdict.usable and "alternatives" not in context.options.include:
        return ()
    shown = others[: context.options.max_alternatives]
    probabilities = probabilities_of_others(verdict, shown)
    sigma = explanations.wall_sigma
    return tuple(_alternative(context, one, sigma, p) for one, p in zip(shown, probabilities, strict=True))


def probabilities_of_others(verdict: Verdict, others: Sequence[ConsensusSet]) -> list[float | None]:
    """Return the probability that each of some other poses is right, 0 to 1; None where the verdict has none to share.

    That of the answer and these together is that the scan explains this place or a similar one: at most 1.
    """
    comparison = verdict.comparison
    if comparison is None or verdict.status is Status.NO_MATCH or verdict.probability is None or verdict.contradicted:
        return [None] * len(others)
    weights = comparison.weights / (1.0 + comparison.weights.sum())
    by_set = {id(one): weight for one, weight in zip(comparison.others, weights.tolist(), strict=True)}
    return [verdict.by_model * by_set.get(id(one), 0.0) * one.inside for one in others]


def _alternative(
    context: SearchContext, other: ConsensusSet, wall_sigma: float, probability: float | None
) -> Alternative:
    """Return another explanation, registered by its pairs with the walls' errors of the answer."""
    accepted = accept(context, other, other.pose)
    registered = register_accepted(context, other, accepted, wall_sigma, None) if len(accepted.pairs) else None
    pose, covariance = context.in_map(other.pose), None
    if registered is not None and registered.pose is not None and not registered.degenerate and not other.free:
        pose, covariance = registered.pose, registered.covariance
    diagnostics = None if registered is None else registered.diagnostics
    return Alternative(
        pose=pose,
        covariance=covariance,
        score=other.score,
        ambiguity=Ambiguity(0.0, 0.0) if diagnostics is None else diagnostics.ambiguity,
        reliability=0.0 if diagnostics is None else diagnostics.reliability,
        inlier_fraction=other.fraction(context.lines.rows),
        probability=probability,
    )
