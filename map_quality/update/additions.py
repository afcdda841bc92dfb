"""Walls that are not in the map, from the lines of many scans."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from association import Deadline
from registration import Segments

from . import tuning
from .beams import lie_on, within
from .evidence import are_enough
from .result import Bools, Floats, Indices
from .scans import Localized, go_on
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

    @property
    def place_count(self) -> int:
        """Number of different squares."""
        return len(np.unique(self.places, axis=0))

    def take(self, rows: Indices) -> SeenLines:
        """Return some of the lines."""
        return SeenLines(self.lines.take(rows), self.visits[rows], self.places[rows], self.weights[rows])


def unexplained(found: Sequence[Localized], known: Segments, deadline: Deadline) -> SeenLines:
    """Return the lines of scans that lie along no wall of the map, or only in part."""
    none = np.zeros(0, dtype=np.intp)
    ends, visits, places, weights = [np.zeros((0, 4))], [none], [none.reshape(0, 2)], [np.zeros(0)]
    for one in found:
        seen, place = one.scan.measured, np.array([one.pose.x, one.pose.y])
        lines = Segments.derived(one.pose.apply(seen.segments.endpoints.reshape(-1, 2)).reshape(-1, 4))
        reach = np.abs(lines.endpoints.reshape(-1, 2) - place).max(initial=0.0)
        near = known.take(within(known, place, 1.5 * float(reach)))
        long = np.flatnonzero(lines.lengths >= tuning.LEAST_SEEN)
        rows = np.array([k for k in long if not _is_on_map(lines.take(np.array([k])), near, deadline)], dtype=np.intp)
        ends.append(lines.endpoints[rows])
        visits.append(np.full(len(rows), one.visit))
        places.append(np.tile(one.place, (len(rows), 1)))
        weights.append(np.maximum(seen.point_counts[rows], 1.0) / np.maximum(seen.sigma[rows], 1e-3) ** 2)
    return SeenLines(
        Segments.derived(np.concatenate(ends)), np.concatenate(visits), np.concatenate(places), np.concatenate(weights)
    )


def _is_on_map(line: Segments, known: Segments, deadline: Deadline) -> bool:
    on_it = lie_on(line.points(tuning.BIN), line.directions[0], known, deadline, near=tuning.ON_MAP)
    return float(on_it.mean()) >= tuning.FULLY_ON_MAP


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
    pieces: list[tuple[Floats, float]] = []
    left = np.argsort(-seen.lines.lengths, kind="stable")
    endpoints, directions = seen.lines.endpoints[left], seen.lines.directions[left]
    while len(left):
        go_on(deadline)
        mine = _along(endpoints, directions)
        rows = left[mine]
        left, endpoints, directions = left[~mine], endpoints[~mine], directions[~mine]
        group = seen.take(rows)
        if len(rows) < tuning.LEAST_VISITS or not are_enough(len(np.unique(group.visits)), group.place_count):
            continue
        found = _pieces(group, known, deadline)
        pieces += found
        if found:  # shorter lines along these are of the same wall, such as those across a rounded corner
            known = Segments.derived(np.concatenate([known.endpoints, [piece for piece, _ in found]]))
    return np.array([piece for piece, _ in pieces]).reshape(-1, 4), np.array([sigma for _, sigma in pieces])


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
    on_map = {"near": tuning.ON_MAP, "past": tuning.ON_MAP, "cosine": tuning.SAME_SIDE}  # also across a round column
    seen[seen] = ~lie_on(place + middles[seen, None] * direction, direction, known, deadline, **on_map)
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
    return place, direction, float(np.sqrt(scatter / group.place_count + 1.0 / weight.sum()) + 0.002)
