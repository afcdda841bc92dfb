"""The answer as a caller gets it: the pose with its correspondences, diagnostics and warnings."""

from __future__ import annotations

import numpy as np

from registration import RegistrationResult
from registration.layout import Floats

from .acceptance import correspondences
from .context import SearchContext
from .explain import Answer, Explanations
from .families import free_direction
from .ranking import Ranked
from .result import (
    Alternative,
    AssociationDiagnostics,
    AssociationResult,
    AssociationWarning,
    SearchReport,
    Status,
)
from .sight import missing_segments
from .tuning import FACING
from .verdict import Verdict


def report(context: SearchContext, explanations: Explanations, verdict: Verdict) -> AssociationResult:
    """Put an answer together."""
    answer = explanations.answer
    if answer is None or verdict.status is Status.NO_MATCH:
        return _no_match(context, explanations, verdict)
    degenerate = verdict.status is Status.DEGENERATE
    matched, on_map = set(answer.accepted.scan_indices), set(answer.accepted.map_indices(context.index))
    return AssociationResult(
        status=verdict.status,
        usable=verdict.usable,
        probability=verdict.probability,
        pose=verdict.pose,
        covariance=None if degenerate else _covariance(answer.registered),
        unobservable=free_direction(answer.registered) if degenerate else None,
        correspondences=correspondences(context.index, answer.accepted, answer.registered),
        unmatched_scan=tuple(i for i in range(len(context.scan.measured)) if i not in matched),
        missing_map=tuple(i for i in missing_segments(context, answer.best) if i not in on_map),
        diagnostics=_diagnostics(answer, verdict),
        alternatives=_alternatives(context, explanations.others),
        search=explanations.search,
        warnings=_warnings(context, explanations.search, verdict),
    )


def _no_match(context: SearchContext, explanations: Explanations, verdict: Verdict) -> AssociationResult:
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
        alternatives=_alternatives(context, explanations.ranked),
        search=explanations.search,
        warnings=_warnings(context, explanations.search, verdict),
    )


def _diagnostics(answer: Answer, verdict: Verdict) -> AssociationDiagnostics:
    return AssociationDiagnostics(
        registration=answer.registered.diagnostics,
        inlier_fraction=answer.best.share,
        score=answer.best.score,
        runner_up=verdict.runner_up,
        margin=verdict.margin,
        significance=answer.significance,
    )


def _covariance(registered: RegistrationResult) -> Floats | None:
    """Return the covariance, widened by chi2 / dof where the residuals are larger than the sigmas can explain.

    A map that is a centimetre off, with sigma 0, would otherwise claim half a millimetre.
    """
    if registered.covariance is None or registered.usable:
        return registered.covariance
    diagnostics = registered.diagnostics
    return np.asarray(registered.covariance * max(1.0, diagnostics.chi2 / max(1, diagnostics.dof)))


def _alternatives(context: SearchContext, others: tuple[Ranked, ...]) -> tuple[Alternative, ...]:
    return tuple(
        Alternative(
            pose=context.in_map(other.pose),
            covariance=other.covariance,
            score=other.score,
            reliability=other.reliability,
            inlier_fraction=other.share,
        )
        for other in others[: context.options.max_alternatives]
    )


def _warnings(context: SearchContext, search: SearchReport, verdict: Verdict) -> tuple[AssociationWarning, ...]:
    found, count = [], len(context.scan.measured)
    if count == 0:
        found.append(AssociationWarning("no_segments", "The scan has no segments, so that nothing could be searched."))
    away = _facing_away(context) if context.options.oriented else 0
    if away:
        found.append(
            AssociationWarning(
                "faces_away",
                f"{away} of {count} segments show their back to the viewpoint, from where nobody can see them: are "
                "begin and end exchanged, or is this not the sensor's frame?",
            )
        )
    if verdict.contradicted:
        found.append(
            AssociationWarning("prior_contradicted", "A clearly better pose lies where the prior says it should not.")
        )
    if not search.complete:
        found.append(
            AssociationWarning(
                "search_incomplete", "The deadline ended the search; a better pose may have been missed."
            )
        )
    return tuple(found)


def _facing_away(context: SearchContext) -> int:
    """Count the segments whose left, where free space is, is not where the sensor stood."""
    if context.scan.viewpoint is None:
        return 0
    segments = context.scan.measured.segments
    fronts = np.einsum("ij,ij->i", segments.normals, np.asarray(context.scan.viewpoint) - segments.midpoints)
    return int((fronts < -FACING).sum())
