"""The search itself: from a scan and a map index to the poses that explain the scan best."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ._keeping_kernels import BEST_SIZE, FOUND_COLUMNS, HARD_PRIOR, NO_PRIOR, PRIOR_SIZE, SOFT_PRIOR
from ._plan_kernels import BUDGET, EXHAUSTED, PROVEN, advance, plan_bases
from ._search_kernels import search_slides
from .map_index import MapIndex
from .options import AssociationOptions, CancelledError, Deadline, HardPrior, Prior, SoftPrior
from .result import SearchReport
from .scan_rows import ScanRows, gates

Floats = NDArray[np.float64]

KEPT = 64  # poses
KEEP_SHARE = 0.65  # of the best value; poses below it are no rivals
# Where raw beams are to decide, the segments propose more.
KEPT_FOR_BEAMS = 192
KEEP_SHARE_FOR_BEAMS = 0.5
RIVAL_SHARE = 0.95  # of the best value; a pose above it must not have been missed
DISTINCT_DISTANCE = 0.3  # m
DISTINCT_ANGLE = 0.1  # rad
BASE_SEGMENTS = 40  # bases are drawn among this many of the most telling segments
SLIDE_SEGMENTS = 4
SLIDE_SPACING = 2.0  # m; what is found stands for the family along the walls
SLIDE_SPACING_FOR_BEAMS = 0.5  # m; there beams tell where along them
KEPT_SLIDES = 64
PARALLEL_SINE = 0.1
CHUNK = 300_000  # tests of a wall between two looks at the clock, a few milliseconds
USUAL_CROWD = 8.0  # walls on the list that a place on a wall has
SAMPLE_WORDS = 160  # of 64 samples, a resolution of 1e-4


@dataclass(frozen=True, slots=True)
class Candidates:
    """What the search found.

    Attributes
    ----------
    poses : (k, 3) theta, t_x, t_y, index frame from scan frame; the best value first
    report : SearchReport
    """

    poses: Floats
    report: SearchReport


@lru_cache(maxsize=BASE_SEGMENTS + 1)
def _sampled_inliers(n: int) -> NDArray[np.uint64]:
    """Sample consensus sets among n segments: ``[m, i]`` says for 64 samples a word whether i is in a set of m + 1.

    All sets of a size are as likely. A better consensus set has so many segments at least, whichever they are.
    """
    draws = np.random.default_rng(20190901).random((SAMPLE_WORDS * 64, n))
    ranks = np.argsort(np.argsort(draws, axis=1), axis=1).T
    bits = np.packbits(ranks[None] <= np.arange(n)[:, None, None], axis=-1)
    return np.ascontiguousarray(bits).view(np.uint64)


def _sliding_segments(rows: Floats, floor: float) -> list[int]:
    """Pick the two longest segments of each class of parallel ones that may explain more than `floor` nats."""
    few = rows[:BASE_SEGMENTS]
    parallel = np.abs(np.outer(few[:, 0], rows[:, 1]) - np.outer(few[:, 1], rows[:, 0])) < PARALLEL_SINE
    promising = parallel @ rows[:, 12] > floor
    chosen: list[int] = []
    for i in np.nonzero(promising)[0]:
        if len(chosen) < SLIDE_SEGMENTS and parallel[i, chosen].sum() < 2:
            chosen.append(int(i))
    return chosen


def encode_prior(prior: Prior | None, origin: Floats) -> Floats:
    """Flatten a prior for the kernels, in the index frame."""
    out = np.zeros(PRIOR_SIZE)
    out[0] = NO_PRIOR
    if prior is None:
        return out
    out[1:4] = prior.pose.x - origin[0], prior.pose.y - origin[1], prior.pose.theta
    if isinstance(prior, HardPrior):
        out[0] = HARD_PRIOR
        out[4:6] = prior.radius, prior.angle
    elif isinstance(prior, SoftPrior):
        out[0] = SOFT_PRIOR
        information = np.linalg.inv(prior.covariance)
        out[4:] = information[np.triu_indices(3)]
    return out


def find_candidates(
    index: MapIndex,
    scan: ScanRows,
    prior: Prior | None,
    options: AssociationOptions,
    deadline: Deadline,
    *,
    for_beams: bool = False,
) -> Candidates:
    """Go through bases until nothing better can have been missed, the bases are used up or the deadline passes.

    Poses are kept more freely when raw beams are to decide between them (`for_beams`).

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    if not isinstance(prior, HardPrior):
        return _search(index, scan, prior, (options, deadline), for_beams=for_beams)
    # A window is searched by itself; the whole map shows whether a clearly better pose lies outside.
    within = _search(index, scan, prior, (options, deadline), for_beams=for_beams)
    anywhere = _search(index, scan, None, (options, deadline), for_beams=for_beams)
    one, other = within.report, anywhere.report
    report = SearchReport(
        complete=one.complete and other.complete,
        exhaustive=one.exhaustive and other.exhaustive,
        confidence=min(one.confidence, other.confidence),
        bases=one.bases + other.bases,
        hypotheses=one.hypotheses + other.hypotheses,
        verified=one.verified + other.verified,
        seed=options.seed,
    )
    return Candidates(np.concatenate([within.poses, anywhere.poses]), report)


def _search(
    index: MapIndex, scan: ScanRows, prior: Prior | None, how: tuple[AssociationOptions, Deadline], *, for_beams: bool
) -> Candidates:
    """Search the map, or the window of a hard prior."""
    options, deadline = how
    walls, runs, grid, sectors, raster = index.walls, index.runs, index.grid, index.sectors, index.raster
    gate = gates(options)
    kept, share = (KEPT_FOR_BEAMS, KEEP_SHARE_FOR_BEAMS) if for_beams else (KEPT, KEEP_SHARE)
    rules = np.array([share, DISTINCT_DISTANCE, DISTINCT_ANGLE, RIVAL_SHARE])
    flat_prior = encode_prior(prior, index.origin)
    found, count, best = np.zeros((kept, FOUND_COLUMNS)), np.zeros(1, dtype=np.int64), np.zeros(BEST_SIZE)
    rows = scan.rows
    n = min(len(rows), BASE_SEGMENTS)
    pairs, merits = plan_bases(rows, n, runs.bin_starts, runs.longest, runs.summed, index.area)
    progress, resume = np.array([0, 0, 0, 0, -1]), np.array([-np.inf])
    # A test of a pose takes longer the more walls lie where it is.
    chunk = int(CHUNK / max(1.0, index.crowd / USUAL_CROWD))
    uses, residual, bound = np.zeros(n), rows[:, 12].copy(), np.array([rows[:, 12].sum()])
    inliers = _sampled_inliers(n)
    missing = np.full((n, SAMPLE_WORDS), ~np.uint64(0))
    best_gains = -np.sort(-rows[:n, 12])
    miss = np.array([1.0, 1.0 - options.confidence])
    stopped = EXHAUSTED if len(pairs) == 0 else BUDGET
    while stopped == BUDGET and not deadline.passed:
        stopped = advance(
            rows, runs.rows, runs.bin_starts, walls.rows, grid.starts, grid.items, grid.shape, raster.shape,
            raster.bits, sectors.starts, sectors.items, sectors.shape, gate, rules, flat_prior, found, count, best,
            progress, resume, pairs, merits, uses, residual, bound, best_gains, missing, inliers, miss,
            options.exhaustive, chunk,
        )  # fmt: skip
    # Parallel walls alone, as in a corridor, fix the pose across them: no base shows it, yet it may explain more.
    slides, slide_count = np.zeros((KEPT_SLIDES, FOUND_COLUMNS)), np.zeros(1, dtype=np.int64)
    spacing = SLIDE_SPACING_FOR_BEAMS if for_beams else SLIDE_SPACING
    if isinstance(prior, HardPrior):
        spacing = min(spacing, prior.radius)
    rules[1] = 0.9 * spacing
    slid = True
    for a in _sliding_segments(rows, (share if for_beams else RIVAL_SHARE) * best[0]):
        place, slid = np.zeros(2, dtype=np.int64), False
        while not slid and not deadline.passed:
            slid = search_slides(
                rows, a, runs.rows, runs.bin_starts, walls.rows, grid.starts, grid.items, grid.shape, raster.shape,
                raster.bits, gate, rules, flat_prior, slides, slide_count, best, progress, spacing, place, chunk,
            )  # fmt: skip
        if not slid:
            break
    found = np.concatenate([found[: count[0]], slides[: slide_count[0]]])
    if deadline.cancelled:
        raise CancelledError
    order = np.argsort(-found[:, 0], kind="stable")
    report = SearchReport(
        complete=stopped != BUDGET and slid,
        exhaustive=stopped == EXHAUSTED and len(rows) <= BASE_SEGMENTS,
        confidence=1.0 if stopped in (EXHAUSTED, PROVEN) else 1.0 - float(miss[0]),
        bases=int(progress[0]),
        hypotheses=int(progress[2]),
        verified=int(progress[3]),
        seed=options.seed,
    )
    return Candidates(found[order, 1:4], report)
