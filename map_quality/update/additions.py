"""Walls that are not in the map, from the lines of many scans."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from association import Deadline
from registration import Segments

from . import tuning
from .beams import within
from .evidence import are_enough
from .result import Bools, Floats, Indices
from .scans import Localized, blocks, go_on
from .walls import runs


@dataclass(frozen=True, slots=True, eq=False)
class SeenLines:
    """Lines of scans, in the map frame, that the map does not show.

    Attributes
    ----------
    lines : Segments
    visits : (n,)
    places : (n, 2)
        Squares in which they were seen from.
    weights : (n,)
        Information about the offset of each line, 1 / m^2.
    """

    lines: Segments
    visits: Indices
    places: Indices
    weights: Floats

    def take(self, rows: Indices | Bools) -> SeenLines:
        """Return some of the lines."""
        kept = np.flatnonzero(rows) if rows.dtype == bool else rows
        return SeenLines(self.lines.take(kept), self.visits[kept], self.places[kept], self.weights[kept])


def unexplained(found: Sequence[Localized], known: Segments, deadline: Deadline) -> SeenLines:
    """Return the lines of scans that lie along no wall of the map, or only in part."""
    none = np.zeros(0, dtype=np.intp)
    ends, visits, places, weights = [np.zeros((0, 4))], [none], [none.reshape(0, 2)], [np.zeros(0)]
    for one in found:
        seen = one.scan.measured
        long = np.flatnonzero(seen.segments.lengths >= tuning.LEAST_SEEN)
        lines = Segments.derived(one.pose.apply(seen.segments.endpoints[long].reshape(-1, 2)).reshape(-1, 4))
        place = np.array([one.pose.x, one.pose.y])
        reach = np.abs(lines.endpoints.reshape(-1, 2) - place).max(initial=0.0)
        near = known.take(within(known, place, 1.5 * float(reach)))
        new = _fraction_on_map(lines, near, deadline) < tuning.FULLY_ON_MAP
        rows = long[new]
        ends.append(lines.endpoints[new])
        visits.append(np.full(len(rows), one.visit))
        places.append(np.tile(one.place, (len(rows), 1)))
        weights.append(np.maximum(seen.point_counts[rows], 1.0) / np.maximum(seen.sigma[rows], 1e-3) ** 2)
    return SeenLines(
        Segments.derived(np.concatenate(ends)), np.concatenate(visits), np.concatenate(places), np.concatenate(weights)
    )


def _fraction_on_map(lines: Segments, known: Segments, deadline: Deadline) -> Floats:
    """Return which fraction of each line lies along walls of the map that face the same way, at most 1, (n,)."""
    covered = np.zeros(len(lines))
    for part in blocks(len(lines), len(known), deadline):
        parallel = lines.directions[part] @ known.directions.T >= np.cos(2.0 * tuning.SAME_ANGLE)
        beside = np.abs(lines.midpoints[part] @ known.normals.T - known.offsets) <= tuning.ON_MAP
        rows, walls = np.nonzero(parallel & beside)
        rows += part.start
        direction = lines.directions[rows]
        ends = [np.einsum("ij,ij->i", known.endpoints[walls, k : k + 2] - lines.endpoints[rows, :2], direction)
                for k in (0, 2)]  # fmt: skip
        low, high = np.maximum(np.minimum(*ends), 0.0), np.minimum(np.maximum(*ends), lines.lengths[rows])
        covered += np.bincount(rows, np.maximum(0.0, high - low), len(lines))
    return np.asarray(np.minimum(1.0, covered / lines.lengths))


def candidates(seen: SeenLines, known: Segments, deadline: Deadline) -> tuple[Floats, Floats]:
    """Join lines of several scans to walls that may be new.

    Parameters
    ----------
    seen : SeenLines
    known : Segments
        Of the map; what lies along them, or along a longer new wall, is left out.
    deadline : Deadline

    Returns
    -------
    (k, 4)
        Their ends, metres, free space on the left.
    (k,)
        Standard deviation of each normal to itself, metres.
    """
    walls: list[Floats] = []
    sigmas: list[float] = []
    left = np.argsort(-seen.lines.lengths, kind="stable")
    endpoints, directions = seen.lines.endpoints[left], seen.lines.directions[left]
    while len(left):
        go_on(deadline)
        mine = _along(endpoints, directions)
        rows = left[mine]
        left, endpoints, directions = left[~mine], endpoints[~mine], directions[~mine]
        if not _is_seen_often(seen.visits[rows], seen.places[rows]):
            continue
        group = seen.take(rows)
        found = _pieces(group, known, deadline)
        walls += [piece for piece, _ in found]
        sigmas += [sigma for _, sigma in found]
        if found:  # shorter lines along these are of the same wall, such as those across a rounded corner
            known = Segments.derived(np.concatenate([known.endpoints, [piece for piece, _ in found]]))
    return np.array(walls).reshape(-1, 4), np.array(sigmas)


def _is_seen_often(visits: Indices, places: Indices) -> bool:
    if len(visits) < tuning.LEAST_VISITS:
        return False
    return bool(are_enough(len(np.unique(visits)), len(np.unique(places, axis=0))))


def _along(endpoints: Floats, directions: Floats) -> Bools:
    """Return which lines continue or repeat the first one, itself included."""
    direction = directions[0]
    normal = np.array([-direction[1], direction[0]])
    offset = 0.5 * float((endpoints[0, :2] + endpoints[0, 2:]) @ normal)
    mine = directions @ direction >= np.cos(tuning.SAME_ANGLE)
    for points in (endpoints[:, :2], endpoints[:, 2:]):
        mine &= np.abs(points @ normal - offset) <= tuning.SAME_LINE
    begins, ends = endpoints[:, :2] @ direction, endpoints[:, 2:] @ direction
    order = np.flatnonzero(mine)
    order = order[np.argsort(begins[order], kind="stable")]
    apart = begins[order[1:]] > np.maximum.accumulate(ends[order])[:-1] + tuning.SAME_GAP
    piece = np.cumsum(np.append(0, apart))
    mine[order] = piece == piece[order == 0]
    return np.asarray(mine)


def _pieces(group: SeenLines, known: Segments, deadline: Deadline) -> list[tuple[Floats, float]]:
    """Return the pieces of one line that several visits show, with their sigma; none along a wall of the map."""
    place, direction, sigma = _fit(group)
    begins = (group.lines.endpoints[:, :2] - place) @ direction
    ends = (group.lines.endpoints[:, 2:] - place) @ direction
    low = float(begins.min())
    count = int(np.ceil((float(ends.max()) - low) / tuning.BIN)) + 1
    middles = low + tuning.BIN * (np.arange(count) + 0.5)
    covered = np.zeros(count, dtype=np.intp)
    for visit in np.unique(group.visits):
        mine = group.visits == visit
        first, past = np.searchsorted(middles, begins[mine]), np.searchsorted(middles, ends[mine], side="right")
        steps = np.bincount(first, minlength=count + 1) - np.bincount(past, minlength=count + 1)
        covered += np.cumsum(steps[:count]) > 0
    seen = covered >= tuning.LEAST_VISITS
    seen[seen] = ~_on_map(known, place + middles[seen, None] * direction, direction, deadline)
    long = np.array([run for run in runs(seen) if (run[1] - run[0]) * tuning.BIN >= tuning.LEAST_PIECE]).reshape(-1, 2)
    ends = place + (low + tuning.BIN * long)[..., None] * direction
    return [(piece, sigma) for piece in ends.reshape(-1, 4)]


def _fit(group: SeenLines) -> tuple[Floats, Floats, float]:
    """Fit one line through lines: a place on it, its direction, and the standard deviation normal to it, metres."""
    lines, weight = group.lines, group.weights
    place = weight @ lines.midpoints / weight.sum()
    off = lines.midpoints - place
    half = 0.5 * lines.lengths[:, None] * lines.directions
    spread = (off * weight[:, None]).T @ off + (half * weight[:, None]).T @ half / 3.0
    direction: Floats = np.linalg.eigh(spread)[1][:, -1].astype(np.float64)
    direction = direction if direction @ (weight @ lines.directions) > 0.0 else -direction
    normal = np.array([-direction[1], direction[0]])
    residuals = off @ normal
    scatter = float(weight @ residuals**2 / weight.sum())
    # Lines of one place share the error of its pose.
    places = len(np.unique(group.places, axis=0))
    return place, direction, float(np.sqrt(scatter / places + 1.0 / weight.sum()) + 0.002)


def _on_map(known: Segments, points: Floats, direction: Floats, deadline: Deadline) -> Bools:
    """Return which points of a line lie on a wall of the map that faces about the same way, (k,).

    A line across the sides of a round column is off their directions, too.
    """
    facing = np.flatnonzero(known.directions @ direction >= tuning.SAME_SIDE)
    low = points.min(axis=0, initial=np.inf) - tuning.ON_MAP
    high = points.max(axis=0, initial=-np.inf) + tuning.ON_MAP
    begins, ends = known.endpoints[facing, :2], known.endpoints[facing, 2:]
    met = (np.maximum(begins, ends) >= low).all(axis=1) & (np.minimum(begins, ends) <= high).all(axis=1)
    walls = known.take(facing[met])
    out = np.zeros(len(points), dtype=bool)
    for rows in blocks(len(points), len(walls), deadline):
        off = points[rows, None, :] - walls.endpoints[None, :, :2]
        along = np.clip(np.einsum("kij,ij->ki", off, walls.directions), 0.0, walls.lengths)
        gaps = np.linalg.norm(off - along[..., None] * walls.directions, axis=2)
        out[rows] = (gaps <= tuning.ON_MAP).any(axis=1)
    return out
