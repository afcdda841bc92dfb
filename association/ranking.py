"""The candidates in order: refined, scored with the lines of sight and the prior, and distinct."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform

from ._beam_kernels import rank_beams
from ._keeping_kernels import INSIDE, prior_value
from ._sight_kernels import distinct, rank
from .candidates import DISTINCT_ANGLE, DISTINCT_DISTANCE, Candidates, encode_prior
from .map_index import MapIndex
from .options import AssociationOptions, HardPrior, Prior, Scan
from .scan_rows import ScanRows, gates

Floats = NDArray[np.float64]

LEAST_DISTINCT = 24  # explanations that are told apart at least: the verdict weighs the best against the others
SAME_FAMILY = 12.8  # squared deviations; two poses nearer than that by the better one's covariance are one (99.5 %)
FEW_BEAMS = 60  # for a first look; neighbouring beams say the same
MOST_BEAMS = 180
BEAM_FINALISTS = 32
BEAMS_READ = 100.0  # nats, for a pose at which all beams read the wall they should
BEAMS_PASSED = 50.0  # nats, against one at which all beams passed through a wall


@dataclass(frozen=True, slots=True)
class Ranked:
    """One explanation of the scan.

    Attributes
    ----------
    pose : RigidTransform
        Index frame from scan frame.
    covariance : (3, 3)
        Of additive (x, y, theta), with the model's slack in it.
    score : float
        Log-likelihood over that of a scan that is all clutter, nats; without the prior.
    value : float
        Score and prior together.
    inside : bool
        Whether it lies within a hard prior's window; True without one.
    share : float
        Of the scan's length that is matched.
    length : float
        Of the matched segments together, metres.
    reliability : float
        Eq. (28).
    misfit : float
        Mean squared offset over what the sigmas alone expect.
    matches : (n, 5)
        By row of the scan, see `_match_kernels`.
    """

    pose: RigidTransform
    covariance: Floats
    score: float
    value: float
    inside: bool
    share: float
    length: float
    reliability: float
    misfit: float
    matches: Floats


def rank_candidates(
    index: MapIndex, scan: Scan, rows: ScanRows, candidates: Candidates, priors: tuple[Prior | None, AssociationOptions]
) -> list[Ranked]:
    """Refine and order the candidates: within the prior's window first, then by value; ties by the search's order."""
    prior, options = priors
    scored = _score(index, scan, rows, candidates.poses, options)
    if scan.beams is not None and len(candidates.poses):
        scored = _weigh_beams(index, scan, rows, scored, priors)
    poses, scores = scored.poses, scored.scores
    values = scores if prior is None else scores + _prior_values(index, prior, poses)
    ranked: list[Ranked] = []
    most = max(LEAST_DISTINCT, options.max_alternatives + 1)
    for i in _distinct(poses, scored.covariances, np.where(scores > 0.0, values, -np.inf), most):
        theta, x, y = (float(v) for v in poses[i])
        hard = values[i] >= INSIDE / 2
        matched = scored.matches[i, :, 0] >= 0.0
        squares = scored.matches[i, matched, 1] ** 2 / rows.rows[matched, 14]
        ranked.append(
            Ranked(
                pose=RigidTransform(x, y, theta),
                covariance=scored.covariances[i],
                score=float(scores[i]),
                value=float(scores[i] if hard else values[i]),
                inside=not isinstance(prior, HardPrior) or bool(hard),
                share=float(scored.shares[i]),
                length=float(rows.rows[matched, 4].sum()),
                reliability=float(scored.reliabilities[i]),
                misfit=float(squares.mean()) if len(squares) else 0.0,
                matches=scored.matches[i],
            )
        )
    return ranked


def _distinct(poses: Floats, covariances: Floats, values: Floats, most: int) -> list[int]:
    """Order the best `most` poses (k, 3) by value, ties by index, without those that a better one stands for."""
    order = np.argsort(-values, kind="stable")
    order = order[: int(np.isfinite(values).sum())]
    rules = np.array([DISTINCT_DISTANCE, DISTINCT_ANGLE, SAME_FAMILY])
    kept: list[int] = distinct(poses, covariances, order, most, rules).tolist()
    return kept


@dataclass(frozen=True, slots=True)
class _Scored:
    """Arrays over k candidates, see `_sight_kernels.rank`."""

    poses: Floats
    scores: Floats
    covariances: Floats
    shares: Floats
    reliabilities: Floats
    matches: Floats


def _score(index: MapIndex, scan: Scan, rows: ScanRows, at: Floats, options: AssociationOptions) -> _Scored:
    """Refine the poses on their consensus sets and score those, with lines of sight unless there are beams."""
    k, n = len(at), len(rows.rows)
    scored = _Scored(at.copy(), np.zeros(k), np.zeros((k, 3, 3)), np.zeros(k), np.zeros(k), np.zeros((k, n, 5)))
    rank(
        rows.rows, scored.poses, index.walls.rows, index.grid.starts, index.grid.items, index.grid.shape,
        gates(options),
        _viewpoint(scan), scan.viewpoint is not None and scan.beams is None, scored.scores, scored.covariances,
        scored.shares, scored.reliabilities, scored.matches,
    )  # fmt: skip
    return scored


def _weigh_beams(
    index: MapIndex, scan: Scan, rows: ScanRows, scored: _Scored, priors: tuple[Prior | None, AssociationOptions]
) -> _Scored:
    """Add what the raw beams say to the scores, and move the best poses to where the beams fit."""
    prior, options = priors
    by_few = scored.scores + _beam_scores(index, scan, scored.poses, FEW_BEAMS, 0)
    best = np.argsort(-by_few, kind="stable")[:BEAM_FINALISTS]
    if isinstance(prior, HardPrior):
        # What lies within the window is looked at, however good the poses outside are.
        within = np.argsort(-(by_few + _prior_values(index, prior, scored.poses)), kind="stable")[:BEAM_FINALISTS]
        best = np.concatenate([within, best[~np.isin(best, within)]])
    poses = scored.poses[best]
    evidence = _beam_scores(index, scan, poses, MOST_BEAMS, len(poses))
    final = _score(index, scan, rows, poses, options)
    final.scores[:] = np.where(final.scores > 0.0, final.scores + evidence, 0.0)
    return final


def _prior_values(index: MapIndex, prior: Prior | None, poses: Floats) -> Floats:
    """Return what the prior says of each pose, nats."""
    flat = encode_prior(prior, index.origin)
    return np.array([prior_value(flat, *pose) for pose in poses])


def _beam_scores(index: MapIndex, scan: Scan, poses: Floats, most: int, refined: int) -> Floats:
    """Return what at most `most` of the beams say of each pose, nats over a pose where none reads what it should.

    Moves the first `refined` of the poses.
    """
    if scan.beams is None:
        return np.zeros(len(poses))
    known = ~np.isnan(scan.beams.ranges)
    angles, ranges = scan.beams.angles[known], scan.beams.ranges[known]
    step = max(1, math.ceil(len(angles) / most))
    evidence = np.zeros((len(poses), 2))
    rank_beams(
        np.ascontiguousarray(angles[::step]), np.ascontiguousarray(ranges[::step]), scan.beams.range_max,
        _viewpoint(scan), poses, index.walls.rows, index.grid.starts, index.grid.items, index.grid.shape, refined,
        evidence,
    )  # fmt: skip
    return np.asarray(BEAMS_READ * evidence[:, 0] - BEAMS_PASSED * evidence[:, 1])


def _viewpoint(scan: Scan) -> Floats:
    return np.array(scan.viewpoint if scan.viewpoint is not None else (0.0, 0.0))
