"""The answer as a caller gets it: the pose with its correspondences, diagnostics and warnings."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from itertools import islice

import numpy as np

from registration import Ambiguity

from .consensus.acceptance import correspondences, overlaps_at
from .consensus.consensus_set import ConsensusSet, matches_of
from .consensus.estimation import EstimatedPose, estimate_poses, slices_between_looks
from .consensus.kernels.measures import paper_measures
from .consensus.ranking import with_lines_of_sight
from .consensus.sight import missing_segments
from .context import SearchContext
from .explanations import Answer, Explanations
from .layout import POSE_AMONG_WALLS
from .result import Alternative, AssociationDiagnostics, AssociationResult, Correspondence, CriticalWall, Status
from .to_scale import ScaledSearch
from .tuning import CRITICAL_DISPLACEMENT
from .verdict.alternatives import compare_alternatives
from .verdict.verdict import Verdict
from .warnings import warnings_of, warnings_of_map


def report(found: ScaledSearch, verdict: Verdict) -> AssociationResult:
    """Put an answer together of a search and the verdict on it.

    If the deadline passes before it is put together, the answer is not complete, and so not usable.
    """
    context, explanations = found.context, found.explanations
    answer = None if verdict.status is Status.NO_MATCH else explanations.answer
    others = explanations.ranked if answer is None else explanations.others
    alternatives = _alternatives(context, explanations, others, verdict)
    missing = () if answer is None else _missing_map(context, answer)
    if context.deadline.passed:
        verdict = verdict.cut_short()
    if not verdict.complete:
        explanations = replace(explanations, search=explanations.search.cut_short())
    if answer is None:
        return _no_match(context, explanations, verdict, alternatives)
    degenerate, parts = verdict.status is Status.DEGENERATE, context.options.parts
    matched, on_map = set(answer.accepted.scan_indices), set(answer.accepted.map_indices(context.index))
    return AssociationResult(
        status=verdict.status,
        usable=verdict.usable,
        probability=verdict.probability,
        pose=verdict.pose,
        covariance=None if degenerate or context.options.estimator == "one_step" else answer.estimated.covariance,
        unobservable=answer.estimated.direction if degenerate else None,
        correspondences=_correspondences(context, answer, verdict) if "correspondences" in parts else (),
        unmatched_scan=tuple(i for i in range(len(context.scan.measured)) if i not in matched),
        missing_map=tuple(i for i in missing if i not in on_map),
        diagnostics=_diagnostics(context, answer, verdict),
        reasons=verdict.reasons,
        alternatives=alternatives,
        search=explanations.search,
        warnings=(*warnings_of(context, explanations.search, verdict), *warnings_of_map(found)),
    )


def _correspondences(context: SearchContext, answer: Answer, verdict: Verdict) -> tuple[Correspondence, ...]:
    """Return the consensus set, with the overlaps at the pose that is answered."""
    accepted, overlaps = answer.accepted, answer.accepted.overlaps
    if verdict.pose is not None:
        overlaps = overlaps_at(context, answer.best, accepted, verdict.pose)
    return correspondences(context.index, accepted, overlaps, answer.registered)


def _no_match(
    context: SearchContext, explanations: Explanations, verdict: Verdict, alternatives: tuple[Alternative, ...]
) -> AssociationResult:
    return AssociationResult(
        status=Status.NO_MATCH,
        usable=False,
        probability=0.0,
        pose=None,
        covariance=None,
        unobservable=None,
        correspondences=(),
        unmatched_scan=tuple(range(len(context.scan.measured))),
        missing_map=(),
        diagnostics=None,
        reasons=verdict.reasons,
        alternatives=alternatives,
        search=explanations.search,
        warnings=warnings_of(context, explanations.search, verdict),
    )


def _diagnostics(context: SearchContext, answer: Answer, verdict: Verdict) -> AssociationDiagnostics:
    return AssociationDiagnostics(
        registration=answer.registered.diagnostics,
        inlier_fraction=answer.best.fraction,
        score=answer.best.score_by(context.options.estimator),
        runner_up=verdict.runner_up,
        margin=verdict.margin,
        critical_wall=_critical_wall(context, answer),
    )


def _critical_wall(context: SearchContext, answer: Answer) -> CriticalWall | None:
    """Return the wall without which the pose would move most or be free; None where it would hardly move."""
    moves, wall, direction = 0.0, -1, (0.0, 0.0)
    for w, moved, deviation, dx, dy, _ in answer.estimated.leverages.tolist():
        if max(moved, deviation) > moves:
            moves, wall, direction = max(moved, deviation), w, (dx, dy)
    if moves < CRITICAL_DISPLACEMENT:
        return None
    walls = answer.best.matches["wall"][context.lines.row_of[answer.accepted.pairs[:, 0]]]
    on_it = context.index.is_one_wall(walls, wall)
    scan = answer.accepted.pairs[on_it, 0].tolist()
    on_map = sorted({i for i, there in zip(answer.accepted.map_indices(context.index), on_it, strict=True) if there})
    return CriticalWall(tuple(scan), tuple(on_map), direction, moves)


def _missing_map(context: SearchContext, answer: Answer) -> tuple[int, ...]:
    return missing_segments(context, answer.best) if "missing_map" in context.options.parts else ()


def _alternatives(
    context: SearchContext, explanations: Explanations, others: Iterable[ConsensusSet], verdict: Verdict
) -> tuple[Alternative, ...]:
    if verdict.usable and "alternatives" not in context.options.parts:
        return ()
    shown = tuple(islice(with_lines_of_sight(context, explanations.ranked, others), context.options.max_alternatives))
    if not shown:
        return ()
    estimated = estimate_poses(context, shown)
    probabilities = probabilities_of_others(explanations.answer, verdict, shown)
    found: list[Alternative] = []
    for some in slices_between_looks(context, len(estimated)):
        measures = _measures(context, shown[some], estimated[some])
        found += map(partial(_alternative, context), shown[some], estimated[some], measures, probabilities[some])
    return tuple(found)


def _measures(
    context: SearchContext, shown: Sequence[ConsensusSet], estimated: Sequence[EstimatedPose]
) -> list[list[float]]:
    """Return the paper's measures of consensus sets at their estimated poses, of which there may be fewer."""
    poses = np.array([(one.pose.theta, one.pose.x, one.pose.y, one.wall_sigma) for one in estimated], POSE_AMONG_WALLS)
    measures: list[list[float]] = paper_measures(
        context.lines.rows, matches_of(shown[: len(estimated)]), context.known_walls, poses
    ).tolist()
    return measures


def probabilities_of_others(
    answer: Answer | None, verdict: Verdict, others: Sequence[ConsensusSet]
) -> list[float | None]:
    """Return the probability that each of some other poses is right, 0 to 1; None where the verdict has none to share.

    As in `probability_among`: the best explanation weighs 1, another one what it is counted, reduced by its gap.
    """
    if answer is None or verdict.status is Status.NO_MATCH or verdict.probability is None or verdict.contradicted:
        return [None] * len(others)
    alternatives = compare_alternatives(answer.best, others)
    parts = alternatives["counted"] * np.exp(np.minimum(0.0, alternatives["gap"]))
    inside = [one.inside for one in others]  # a hard prior excludes the others
    found: list[float | None] = (verdict.probability * parts * inside).tolist()
    return found


def _alternative(
    context: SearchContext,
    other: ConsensusSet,
    estimated: EstimatedPose,
    measures: list[float],
    probability: float | None,
) -> Alternative:
    translation, mitsuta, wahba, reliability = measures
    return Alternative(
        pose=context.in_map(estimated.pose),
        covariance=None if estimated.degenerate else estimated.covariance,
        score=other.score_by(context.options.estimator),
        ambiguity=Ambiguity(translation, wahba if context.options.rotation == "wahba" else mitsuta),
        reliability=reliability,
        inlier_fraction=other.fraction,
        probability=probability,
    )
