"""A factor near one by which a scan and a map differ, from matches that tolerate it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from registration.layout import Records

from ..context import SearchContext
from ..scan.scan import Scan
from ..search.candidates import Effort, allowed_by, find_candidates
from ..tuning import (
    GREATEST_STRETCH,
    LEAST_STRETCH,
    REACH,
    SCALE_FITS,
    SCALE_KEPT,
    SCALE_LENGTH,
    SCALE_OUTLIER,
    SCALE_SHARE,
)
from .ranking import Ranked, rank_candidates


def scale_near_one(context: SearchContext) -> float | None:
    """Estimate what the scan has to be multiplied with, where that is within `GREATEST_STRETCH` of one.

    The scan is searched with the widest gate on offsets. At a place in the scan's frame a factor of ``1 + e`` puts a
    wall off by e times its distance, so that the walls near the sensor are found all the same; a similarity fitted to
    the matches of each of the best poses has the factor.

    Returns
    -------
    float or None
        The factor of the pose whose matches agree best with one; None where none says that it is another than one.
    """
    options = replace(context.options, offset_tolerance=REACH)
    lax = SearchContext.of(context.index, Scan(context.scan.measured, None, None), None, options, context.deadline)
    found = rank_candidates(
        lax, find_candidates(lax, Effort(SCALE_KEPT, SCALE_SHARE, SCALE_SHARE, allowed_by(options)))
    )
    best: tuple[float, float] | None = None
    for one in found[:SCALE_KEPT]:
        if one.share < SCALE_LENGTH:
            continue
        factor, left = _similarity(lax, one)
        if LEAST_STRETCH <= abs(factor - 1.0) <= GREATEST_STRETCH and (best is None or left < best[0]):
            best = left, factor
    return None if best is None else best[1]


def _similarity(context: SearchContext, ranked: Ranked) -> tuple[float, float]:
    """Fit a similarity to the matches of a pose; return its factor and the median of what it leaves, metres.

    With ``a = s cos theta`` and ``b = s sin theta`` an end of a scan line is off its wall by
    ``n . ((a x - b y, b x + a y) + t) - offset``, which is linear in a, b and t. Ends that are off by much more than
    the median are left out, then fitted again.
    """
    rows = context.lines.rows[ranked.matched]
    walls = context.index.walls.rows[ranked.matches["wall"][ranked.matched]]
    equations, offsets = _equations(rows, walls)
    kept = np.ones(len(offsets), dtype=bool)
    factor, left = 1.0, np.inf
    for _ in range(SCALE_FITS):
        if kept.sum() < 2 * 4:
            return 1.0, np.inf
        solution = np.linalg.lstsq(equations[kept], offsets[kept], rcond=None)[0]
        residuals = np.abs(equations @ solution - offsets)
        factor, left = float(np.hypot(solution[0], solution[1])), float(np.median(residuals))
        kept = residuals <= SCALE_OUTLIER * max(left, 1e-3)
    return factor, left


def _equations(rows: Records, walls: Records) -> tuple[np.ndarray, np.ndarray]:
    """Return the equations of both ends of each line, (2 n, 4), and what they should come to, (2 n,) metres."""
    nx, ny = np.tile(-walls["dy"], 2), np.tile(walls["dx"], 2)
    half = 0.5 * rows["length"]
    x = np.concatenate([rows["x"] - half * rows["dx"], rows["x"] + half * rows["dx"]])
    y = np.concatenate([rows["y"] - half * rows["dy"], rows["y"] + half * rows["dy"]])
    equations = np.stack([nx * x + ny * y, ny * x - nx * y, nx, ny], axis=1)
    return equations, np.tile(walls["offset"], 2)
