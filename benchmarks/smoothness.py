"""The change of an answer where its input changes by 1 mm, or not at all in what it means.

Pairs of requests are drawn: a scan in a drawn room, and the same with a step, a gap, a cut, a reversed or a repeated
piece in the map or in the scan. Steps and gaps differ by 1 mm between the two requests of a pair; the other changes
are there or not, and change no geometry. Half of the steps and gaps are drawn evenly, the others within 1 mm of the
lengths at which pieces used to be joined. A pair fails where the probabilities differ by more than 0.1.

``python -m benchmarks.smoothness [--pairs 2000] [--seed 1] [--list]``
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from association import AssociationOptions, AssociationResult, MapIndex, Scan, View, assemble, associate
from registration import MeasuredSegments, RigidTransform, Segments
from registration.layout import Floats
from simulation import Scanner

from .drawn import take_scan
from .outcomes import progress
from .table import Row, at_most, print_rows

CHANGE = 1e-3  # m
MOST = 0.1  # of the probability; a pair whose answers differ by more fails
GOAL = 0.5  # percent of the pairs
SIGMAS = (None, None, None, 0.0, 0.001, 0.005, 0.02)  # m, of the maps
# Steps and gaps at which pieces were joined by a threshold, m.
MAP_STEPS, MAP_GAPS, SCAN_STEPS, SCAN_GAPS = (0.03,), (0.3, 1.5), (0.04,), (0.3,)
WIDEST_STEP, WIDEST_MAP_GAP, WIDEST_SCAN_GAP = 0.12, 2.0, 0.8  # m
LEAST_PIECE = 0.6  # m; a shorter segment is left as it is


@dataclass(frozen=True, slots=True)
class Request:
    """The request: the map's segments (m, 4) with its sigma, the scan's (n, 4) with sigma and points (n,).

    `seen` are the walls that the scan sees most of, (k,).
    """

    walls: Floats
    map_sigma: float | None
    scan: Floats
    sigma: float
    points: Floats
    seen: NDArray[np.intp]
    oriented: bool = True
    views: int = 1

    def ask(self) -> AssociationResult:
        """Search."""
        measured = MeasuredSegments.from_segments(Segments.from_array(self.scan), self.sigma, self.points)
        scan = Scan(measured)
        if self.views > 1:
            scan = assemble([View(scan)] * self.views)
        index = MapIndex.build(Segments.from_array(self.walls), self.map_sigma)
        return associate(index, scan, options=AssociationOptions(oriented=self.oriented))


Pair = tuple[Request, Request]


def draw_request(rng: np.random.Generator) -> Request:
    """Draw a room with two niches and a pillar, and a scan of it that sees little or much."""
    walls = _room(rng)
    field_of_view, beams = math.radians(rng.uniform(80.0, 270.0)), int(rng.integers(120, 540))
    scanner = Scanner.over(field_of_view, beams, sigma=0.01, range_max=float(rng.uniform(6.0, 14.0)))
    corners = walls[:-4, :2]
    while True:
        x, y = rng.uniform(corners.min(axis=0), corners.max(axis=0))
        pose = RigidTransform(float(x), float(y), float(rng.uniform(-math.pi, math.pi)))
        measured, on = take_scan(Segments.from_array(walls), pose, rng, scanner)
        facing = measured.segments.normals @ [0.0, 0.0] - np.einsum(
            "ij,ij->i", measured.segments.normals, measured.segments.midpoints
        )
        if len(measured) >= 3 and (on >= 0).all() and (facing > 0.0).all():
            break
    # Most scans are thin: of the segments some are left out.
    few = rng.permutation(len(measured))[: rng.integers(3, 7)] if rng.random() < 0.8 else np.arange(len(measured))
    shown = np.bincount(on[few], measured.segments.lengths[few], len(walls))
    seen = np.argsort(-shown, kind="stable")[: max(1, min(3, int((shown > 0.0).sum())))]
    sigma, ends = SIGMAS[rng.integers(len(SIGMAS))], measured.segments.endpoints[few]
    return Request(walls, sigma, ends, 0.01, measured.point_counts[few], seen)


def _room(rng: np.random.Generator) -> Floats:
    width, height = rng.uniform(4.0, 14.0), rng.uniform(4.0, 12.0)
    a, b = rng.uniform(0.1, 0.4) * width, rng.uniform(0.1, 0.3) * height
    c, d = rng.uniform(0.05, 0.3) * width, rng.uniform(0.05, 0.2) * height
    corners = [(width, height), (a, height), (a, height - b), (0.0, height - b), (0.0, 0.0)]
    corners += [(width - c, 0.0), (width - c, d), (width, d)] if rng.random() < 0.5 else [(width, 0.0)]
    x, y = rng.uniform(0.3, 0.6) * width, rng.uniform(0.3, 0.6) * height
    u, v = rng.uniform(0.2, 0.8, 2)
    pillar = [(x, y), (x, y + v), (x + u, y + v), (x + u, y)]
    drawn: Floats = np.vstack([_outline(corners), _outline(pillar)])
    return np.asarray(np.round(drawn, 3), np.float64)


def _outline(corners: Iterable[tuple[float, float]]) -> Floats:
    p = np.array(list(corners))
    return np.hstack([p, np.roll(p, -1, axis=0)])


def _length(rng: np.random.Generator, edges: tuple[float, ...], widest: float) -> float:
    """Return a length such that 1 mm more may cross an edge, or any up to the widest, m."""
    if rng.random() < 0.5:
        return float(edges[rng.integers(len(edges))] - CHANGE * rng.uniform(0.05, 0.95))
    return float(rng.uniform(0.0, widest))


def _split(ends: Floats, row: int, place: float, *, step: float = 0.0, gap: float = 0.0) -> Floats:
    """Return segments of which one is two: cut at a share of its length, the second moved to its left, with a gap."""
    begin, end = ends[row, :2], ends[row, 2:]
    length = math.hypot(*(end - begin))
    along = (end - begin) / length
    left = np.array([-along[1], along[0]]) * step
    first = begin + along * (place * length - 0.5 * gap)
    second = begin + along * (place * length + 0.5 * gap)
    rest = np.delete(ends, row, axis=0)
    return np.vstack([rest, [*begin, *first], [*(second + left), *(end + left)]])


def _long(rng: np.random.Generator, ends: Floats, least: float) -> int:
    """Return a segment of that length at least, m, or the longest."""
    lengths = np.hypot(*(ends[:, 2:] - ends[:, :2]).T)
    rows = np.flatnonzero(lengths >= least)
    return int(rows[rng.integers(len(rows))]) if len(rows) else int(lengths.argmax())


def _wall(rng: np.random.Generator, request: Request, least: float) -> int:
    """Return a wall of that length at least, m, of those that the scan sees most of."""
    return int(request.seen[_long(rng, request.walls[request.seen], least)])


def _with_map(request: Request, walls: Floats) -> Request:
    return replace(request, walls=walls)


def _with_scan(request: Request, row: int, scan: Floats) -> Request:
    """Share the points of a row that was cut among its two parts, which are the last."""
    lengths = np.hypot(*(scan[:, 2:] - scan[:, :2]).T)
    share = lengths[-2] / (lengths[-2] + lengths[-1])
    own = request.points[row]
    points = np.append(np.delete(request.points, row), [share * own, (1.0 - share) * own])
    return replace(request, scan=scan, points=np.maximum(1.0, points))


def map_step(rng: np.random.Generator, request: Request) -> Pair:
    """Move a part of a wall to its left or right."""
    row, place = _wall(rng, request, 2.0), rng.uniform(0.2, 0.8)
    step, sign = _length(rng, MAP_STEPS, WIDEST_STEP), rng.choice((-1.0, 1.0))
    one, other = (_split(request.walls, row, place, step=sign * s) for s in (step, step + CHANGE))
    return _with_map(request, one), _with_map(request, other)


def map_gap(rng: np.random.Generator, request: Request) -> Pair:
    """Leave a gap in a wall."""
    gap = _length(rng, MAP_GAPS, WIDEST_MAP_GAP)
    row, place = _wall(rng, request, 2.5 * gap + 0.5), rng.uniform(0.3, 0.7)
    gap = min(gap, 0.5 * math.hypot(*(request.walls[row, 2:] - request.walls[row, :2])))
    one, other = (_split(request.walls, row, place, gap=g) for g in (gap, gap + CHANGE))
    return _with_map(request, one), _with_map(request, other)


def map_cut(rng: np.random.Generator, request: Request) -> Pair:
    """Cut walls in pieces."""
    walls = request.walls
    for _ in range(int(rng.integers(1, 6))):
        walls = _split(walls, _long(rng, walls, LEAST_PIECE), rng.uniform(0.1, 0.9))
    return request, _with_map(request, walls)


def map_reversed(rng: np.random.Generator, request: Request) -> Pair:
    """Turn some walls round, or add them the other way round, where directions mean nothing."""
    rows = rng.random(len(request.walls)) < 0.4
    turned, plain = request.walls[rows][:, [2, 3, 0, 1]], replace(request, oriented=False)
    if rng.random() < 0.5:
        return plain, _with_map(plain, np.vstack([request.walls, turned]))
    return plain, _with_map(plain, np.vstack([request.walls[~rows], turned]))


def map_repeated(rng: np.random.Generator, request: Request) -> Pair:
    """Add walls, or parts of them, again."""
    return request, _with_map(request, np.vstack([request.walls, _parts(rng, request.walls)]))


def _parts(rng: np.random.Generator, ends: Floats) -> Floats:
    """Return parts of some of the segments, from a tenth of the length up to all of it."""
    rows = ends[rng.random(len(ends)) < 0.4]
    begin = np.where(rng.random(len(rows)) < 0.5, 0.0, rng.uniform(0.0, 0.6, len(rows)))
    end = np.where(rng.random(len(rows)) < 0.5, 1.0, begin + rng.uniform(0.1, 0.4, len(rows)))
    along = rows[:, 2:] - rows[:, :2]
    return np.hstack([rows[:, :2] + begin[:, None] * along, rows[:, :2] + end[:, None] * along])


def scan_step(rng: np.random.Generator, request: Request) -> Pair:
    """Move a part of a scan segment to its left or right."""
    row, place = _long(rng, request.scan, 1.5), rng.uniform(0.2, 0.8)
    step, sign = _length(rng, SCAN_STEPS, WIDEST_STEP), rng.choice((-1.0, 1.0))
    one, other = (_split(request.scan, row, place, step=sign * s) for s in (step, step + CHANGE))
    return _with_scan(request, row, one), _with_scan(request, row, other)


def scan_gap(rng: np.random.Generator, request: Request) -> Pair:
    """Leave a gap in a scan segment."""
    gap = _length(rng, SCAN_GAPS, WIDEST_SCAN_GAP)
    row, place = _long(rng, request.scan, 2.5 * gap + 0.3), rng.uniform(0.4, 0.6)
    length = math.hypot(*(request.scan[row, 2:] - request.scan[row, :2]))
    gap = min(gap, 0.5 * length)
    one, other = (_split(request.scan, row, place, gap=g) for g in (gap, gap + CHANGE))
    return _with_scan(request, row, one), _with_scan(request, row, other)


def scan_cut(rng: np.random.Generator, request: Request) -> Pair:
    """Cut scan segments in pieces."""
    cut = request
    for _ in range(int(rng.integers(1, 5))):
        row = _long(rng, cut.scan, LEAST_PIECE)
        cut = _with_scan(cut, row, _split(cut.scan, row, rng.uniform(0.2, 0.8)))
    return request, cut


def scan_reversed(rng: np.random.Generator, request: Request) -> Pair:
    """Add scan segments the other way round, where directions mean nothing."""
    rows = rng.random(len(request.scan)) < 0.5
    plain = replace(request, oriented=False)
    both = np.vstack([request.scan, request.scan[rows][:, [2, 3, 0, 1]]])
    return plain, replace(plain, scan=both, points=np.append(request.points, request.points[rows]))


def scan_repeated(rng: np.random.Generator, request: Request) -> Pair:
    """Add scan segments again."""
    rows = rng.random(len(request.scan)) < 0.5
    both = np.vstack([request.scan, request.scan[rows]])
    return request, replace(request, scan=both, points=np.append(request.points, request.points[rows]))


def view_repeated(rng: np.random.Generator, request: Request) -> Pair:
    """Send what one view shows two or three times."""
    return request, replace(request, views=int(rng.integers(2, 4)))


KINDS: tuple[Callable[[np.random.Generator, Request], Pair], ...] = (
    map_step, map_gap, map_cut, map_reversed, map_repeated,
    scan_step, scan_gap, scan_cut, scan_reversed, scan_repeated, view_repeated,
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Answered:
    """A pair and both answers."""

    kind: str
    number: int
    pair: Pair
    answers: tuple[AssociationResult, AssociationResult]

    @property
    def difference(self) -> float:
        """Of the probabilities; 0 where there is none, as for a degenerate pose."""
        one, other = self.answers
        return abs((one.probability or 0.0) - (other.probability or 0.0))

    @property
    def flips(self) -> bool:
        """Return whether one answer is usable and the other is not."""
        one, other = self.answers
        return one.usable is not other.usable


def draw_pair(number: int, seed: int) -> tuple[str, Pair]:
    """Draw the pair of that number, and its kind."""
    rng = np.random.default_rng([seed, number])
    kind = KINDS[number % len(KINDS)]
    return kind.__name__, kind(rng, draw_request(rng))


def answered(count: int, seed: int = 1) -> Iterator[Answered]:
    """Draw and answer pairs, of each kind as many."""
    for number in range(count):
        kind, pair = draw_pair(number, seed)
        yield Answered(kind, number, pair, (pair[0].ask(), pair[1].ask()))


def _in_words(answer: AssociationResult) -> str:
    probability = "without a probability" if answer.probability is None else f"{answer.probability:.3f}"
    return f"{answer.status} {probability}"


def rows_of(found: list[Answered]) -> list[Row]:
    """Judge pairs, all together and by kind."""

    def row(what: str, some: list[Answered], goal: float | None = None) -> Row:
        failing = sum(one.difference > MOST for one in some)
        judged = at_most(what, 100.0 * failing / max(1, len(some)), goal, form=".2f")
        worst = max((one.difference for one in some), default=0.0)
        flips = sum(one.flips for one in some)
        told = f"{judged.measured} % ({failing} of {len(some)}); worst {worst:.3f}; usable flips {flips}"
        return replace(judged, measured=told)

    kinds = [kind.__name__ for kind in KINDS]
    rows = [row(kind.replace("_", " "), [one for one in found if one.kind == kind]) for kind in kinds]
    return [*rows, row("all: probability differs by more than 0.1", found, GOAL)]


def smoothness(quick: int) -> list[Row]:
    """Draw 2,000 pairs and judge them."""
    rows = rows_of(list(answered(2000 // quick)))
    print_rows("Smoothness: answers to requests that differ by 1 mm, or in nothing that matters", rows)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--list", action="store_true", help="list the pairs that fail")
    args = parser.parse_args()
    found = []
    for one in answered(args.pairs, args.seed):
        found.append(one)
        progress("pairs", len(found), args.pairs)
    print_rows(f"Smoothness, {args.pairs} pairs, seed {args.seed}", rows_of(found))
    for one in found if args.list else ():
        if one.difference > MOST:
            print(f"- {one.kind} {one.number}: {', '.join(map(_in_words, one.answers))}")


if __name__ == "__main__":
    main()
