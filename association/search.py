"""The main path: from a scan and a map index to a pose with its verdict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from registration import RegistrationResult, RigidTransform

from .accept import accept, correspondences, place_on_family, register_accepted
from .candidates import find_candidates
from .map_index import MapIndex
from .options import AssociationOptions, Deadline, HardPrior, Prior, Scan
from .ranking import Ranked, rank_candidates
from .result import Alternative, AssociationDiagnostics, AssociationResult, AssociationWarning, SearchReport, Status
from .scan_rows import gates, scan_rows
from .sight import agreement, missing_walls
from .significance import significance
from .verdict import Evidence, Verdict, judge

Floats = NDArray[np.float64]

DEFAULT_OPTIONS = AssociationOptions()
FACING = 0.05  # m; a wall seen along itself may pass the sensor on either side


def associate(
    index: MapIndex,
    scan: Scan,
    prior: Prior | None = None,
    options: AssociationOptions = DEFAULT_OPTIONS,
    deadline: Deadline | None = None,
) -> AssociationResult:
    """Find where in a map a scan was taken, without knowing which segment is which.

    Propose poses from bases of two scan segments, verify them, grow and shrink their consensus sets, judge.

    Parameters
    ----------
    index : MapIndex
    scan : Scan
        In the sensor's frame.
    prior : SoftPrior, HardPrior or None
        In the map frame.
    options : AssociationOptions
    deadline : Deadline or None
        When it passes, the best so far is the answer and ``search.complete`` is False.

    Returns
    -------
    AssociationResult

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    if not options.oriented:
        index = index.undirected
    rows = scan_rows(scan, index.sigma, options)
    beams = scan.beams is not None
    candidates = find_candidates(index, rows, prior, options, deadline or Deadline(), for_beams=beams)
    ranked = rank_candidates(index, scan, rows, candidates, (prior, options))
    best = next((r for r in ranked if r.inside), None)
    chance = 1.0 if best is None else significance(index, rows, gates(options), float(best.matches[:, 4].sum()))
    accepted = None if best is None else accept(index, scan, rows, best)
    registered = None if accepted is None else register_accepted(index, scan, accepted, options)
    shown = 0.0 if best is None else agreement(index, scan, rows, best)
    verdict = judge(ranked, registered, Evidence(rows.rows[:, 4], shown, chance, beams))
    if best is None or accepted is None or registered is None or verdict.status is Status.NO_MATCH:
        return _no_match(scan, ranked, verdict, candidates.report, (index, options))
    matched = set(accepted.pairs[:, 0].tolist())
    on_map = set((accepted.pairs[:, 1] % index.directed).tolist())
    pose = registered.pose
    if verdict.status is Status.DEGENERATE:
        pose = place_on_family(index, rows, best, registered, _anchor(index, scan, best, prior))
    if isinstance(prior, HardPrior) and pose is not None and not prior.contains(pose):
        # It was inside before it was registered: the window is narrower than what the scan says.
        verdict = replace(verdict, contradicted=True, probability=min(verdict.probability, 0.5))
    usable = verdict.status is Status.OK and candidates.report.complete and not verdict.contradicted
    return AssociationResult(
        status=verdict.status,
        usable=usable,
        probability=verdict.probability,
        pose=pose,
        covariance=None if verdict.status is Status.DEGENERATE else _covariance(registered),
        unobservable=_weak_direction(registered) if verdict.status is Status.DEGENERATE else None,
        correspondences=correspondences(index, accepted, registered),
        unmatched_scan=tuple(i for i in range(len(scan.measured)) if i not in matched),
        missing_map=tuple(i for i in missing_walls(index, scan, rows, best) if i not in on_map),
        diagnostics=AssociationDiagnostics(
            registration=registered.diagnostics,
            inlier_fraction=best.share,
            score=best.score,
            runner_up=verdict.runner_up,
            margin=verdict.margin,
            significance=chance,
        ),
        alternatives=_alternatives([r for r in ranked if r is not best], index, options),
        search=candidates.report,
        warnings=_warnings(scan, verdict, candidates.report, options),
    )


def _anchor(index: MapIndex, scan: Scan, best: Ranked, prior: Prior | None) -> RigidTransform | None:
    """Return what picks one pose of a family: the prior, else where the raw beams fit best, else nothing."""
    if prior is not None:
        return prior.pose
    if scan.beams is None:
        return None
    x, y = index.origin
    return RigidTransform(best.pose.x + float(x), best.pose.y + float(y), best.pose.theta)


def _covariance(registered: RegistrationResult) -> Floats | None:
    """Return the covariance, widened by chi2 / dof where the residuals are larger than the sigmas can explain.

    A map that is a centimetre off, with sigma 0, would otherwise claim half a millimetre.
    """
    if registered.covariance is None or registered.usable:
        return registered.covariance
    diagnostics = registered.diagnostics
    return np.asarray(registered.covariance * max(1.0, diagnostics.chi2 / max(1, diagnostics.dof)))


def _weak_direction(registered: RegistrationResult) -> tuple[float, float] | None:
    """Return the direction that is not fixed, of the two opposite ones that with a positive first component."""
    if registered.unobservable is not None or registered.covariance is None:
        return registered.unobservable
    axis = np.linalg.eigh(registered.covariance[:2, :2])[1][:, 1]
    axis = axis if axis[0] > 0.0 or (axis[0] == 0.0 and axis[1] > 0.0) else -axis
    return float(axis[0]), float(axis[1])


def _facing_away(scan: Scan) -> int:
    """Count the segments whose left, where free space is, is not where the sensor stood."""
    if scan.viewpoint is None:
        return 0
    segments = scan.measured.segments
    fronts = np.einsum("ij,ij->i", segments.normals, np.asarray(scan.viewpoint) - segments.midpoints)
    return int((fronts < -FACING).sum())


def _alternatives(others: list[Ranked], index: MapIndex, options: AssociationOptions) -> tuple[Alternative, ...]:
    x, y = index.origin
    return tuple(
        Alternative(
            pose=RigidTransform(r.pose.x + float(x), r.pose.y + float(y), r.pose.theta),
            covariance=r.covariance,
            score=r.score,
            reliability=r.reliability,
            inlier_fraction=r.share,
        )
        for r in others[: options.max_alternatives]
    )


def _no_match(
    scan: Scan,
    ranked: list[Ranked],
    verdict: Verdict,
    report: SearchReport,
    place: tuple[MapIndex, AssociationOptions],
) -> AssociationResult:
    return AssociationResult(
        status=Status.NO_MATCH,
        usable=False,
        probability=0.0,
        pose=None,
        covariance=None,
        unobservable=None,
        correspondences=(),
        unmatched_scan=tuple(range(len(scan.measured))),
        missing_map=(),
        diagnostics=None,
        alternatives=_alternatives(ranked, *place),
        search=report,
        warnings=_warnings(scan, verdict, report, place[1]),
    )


def _warnings(
    scan: Scan, verdict: Verdict, report: SearchReport, options: AssociationOptions
) -> tuple[AssociationWarning, ...]:
    found = []
    if len(scan.measured) == 0:
        found.append(AssociationWarning("no_segments", "The scan has no segments, so that nothing could be searched."))
    away = _facing_away(scan) if options.oriented else 0
    if away:
        found.append(
            AssociationWarning(
                "faces_away",
                f"{away} of {len(scan.measured)} segments show their back to the viewpoint, from where nobody can see "
                "them: are begin and end exchanged, or is this not the sensor's frame?",
            )
        )
    if verdict.contradicted:
        found.append(
            AssociationWarning("prior_contradicted", "A clearly better pose lies where the prior says it should not.")
        )
    if not report.complete:
        found.append(
            AssociationWarning(
                "search_incomplete", "The deadline ended the search; a better pose may have been missed."
            )
        )
    return tuple(found)
