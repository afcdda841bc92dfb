"""Match a scan to the walls at a pose: for each scan line the wall that it lies on best."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...index.kernels.walls import fade
from ...tables import Place
from ..tuning import FLAT_GATE, MOST_BRIDGED, OVERLAP_TAPER, WHOLE_SCORE
from .geometry import angle_gate, bins_about, cell_about, offset_gate, rotated
from .wall_chains import Line, follow_both_ways

SUM_SLACK = 1e-9  # nats, rounding


@kernel
def match_scan(
    scan: Records, estimate: Record, place: Place, gates: Record, possible: Floats, threshold: float, matches: Records
) -> float:
    """Match every scan line to the wall that it lies on best, the lines of the greatest gain first.

    1. List the walls near the midpoint of the line, by the grid.
    2. Take those of its direction, within the gates of offset and angle.
    3. Measure how much of the line they cover, with their neighbours on the chain.
    4. Keep the one that is least in offset over gate plus missing overlap.

    Handing on arrays costs more than the work, because Numba counts references to each: what is called here for each
    wall takes records and numbers.

    Parameters
    ----------
    scan : (n,) of `SCAN_LINE`
    estimate : record of `ESTIMATE`
        The pose, with the covariance that the gates go by.
    place : Place
    gates : record of `GATES`
    possible : (n,)
        The greatest possible gain of each line, nats, as of `may_score` or `allow_all`; lines below 0 lie on no wall.
    threshold : float
        Nats; matching ends as soon as the gains cannot come to it.
    matches : (n,) of `MATCH`
        Written to, but for the scores.

    Returns
    -------
    float
        The sum of the gains, nats; -1 below `threshold`.
    """
    walls = place.walls
    bin_starts = place.bin_starts
    starts = place.grid.starts
    items = place.grid.items
    shape = place.grid.shape[0]
    c = math.cos(estimate.theta)
    s = math.sin(estimate.theta)
    total = 0.0
    left = SUM_SLACK
    for i in range(len(scan)):
        left += max(0.0, possible[i])
    for i in range(len(scan)):
        match = matches[i]
        clear_match(match)
        if possible[i] < 0.0:
            continue
        left -= possible[i]
        seen = scan[i]
        gx, gy = rotated(seen.x, seen.y, c, s)
        dx, dy = rotated(seen.dx, seen.dy, c, s)
        here = cell_about(shape, gx + estimate.x, gy + estimate.y)
        if here >= 0 and starts[here] < starts[here + 1]:
            across = offset_gate(seen, estimate, gates, dx * gx + dy * gy, dx, dy)
            turned = angle_gate(seen, estimate.tt, gates)
            line = (gx + estimate.x, gy + estimate.y, dx, dy, seen.length, across)
            cos_gate = 1.0 - 0.5 * turned * turned
            # Walls are numbered by direction: those of its direction are some in a row, from `first` on.
            lowest, highest = bins_about(estimate.theta + seen.angle, turned)
            first = bin_starts[lowest]
            span = bin_starts[highest + 1] - first + (len(walls) if highest < lowest else 0)
            least = 1e300
            left_to_follow = int(np.int64(MOST_BRIDGED))
            for k in range(starts[here], starts[here + 1]):
                w = items[k]
                if w - first + (len(walls) if w < first else 0) >= span:
                    continue
                offset, low, high = lay_on_wall(walls[w], line, cos_gate)
                if high <= low:
                    continue
                if continues(walls[w], low, high, line):
                    counted, covered, aside, squared, left_to_follow = follow_both_ways(
                        walls, w, line, low, high, left_to_follow
                    )
                else:
                    counted, covered, aside, squared = high - low, high - low, 0.0, 0.0
                overlap = min(1.0, counted / line[4])
                shift = aside / covered
                misfit = abs(offset - shift) / across + 1.0 - overlap
                if overlap >= gates.least_overlap and misfit < least:
                    least = misfit
                    match.wall = w
                    match.overlap = overlap
                    match.offset = offset - shift
                    match.shift = shift
                    match.uneven = max(0.0, squared / covered - shift * shift)
                    match.sine = dx * walls[w].dy - dy * walls[w].dx
                    match.gain = gain_of(seen, match, gates, offset, across, turned)
        total += match.gain
        if total + left < threshold:
            break
    return -1.0 if total < threshold else total


@kernel
def clear_match(match: Record) -> None:
    """Write that a scan line lies on no wall."""
    match.wall = -1
    match.overlap = 0.0
    match.gain = 0.0


@kernel
def lay_on_wall(wall: Record, line: Line, cos_gate: float) -> tuple[float, float, float]:
    """Return the offset of a line from a wall, and between which abscissae from its midpoint it lies on that, metres.

    `line` as of `follow_chain`. Beyond its gate, or where the cosine of the angle between both is less than `cos_gate`,
    it lies on nothing of the wall: then these are all 0.
    """
    x, y, dx, dy, length, gate = line
    offset = wall.dx * y - wall.dy * x - wall.offset
    if abs(offset) > gate or wall.dx * dx + wall.dy * dy < cos_gate:
        return 0.0, 0.0, 0.0
    half = 0.5 * length
    along = wall.dx * x + wall.dy * y
    return offset, max(wall.begin - along, -half), min(wall.end - along, half)


@kernel
def continues(wall: Record, low: float, high: float, line: Line) -> bool:
    """Return whether a line that lies on a wall from `low` to `high` goes on where other walls continue that."""
    half = 0.5 * line[4]
    return (low > -half and wall.before >= 0) or (high < half and wall.after >= 0)


@kernel
def gain_of(line: Record, match: Record, gates: Record, offset: float, across: float, turned: float) -> float:
    """Return the gain of a match, nats: by the overlap, and nothing at a gate, so that no gate decides.

    `offset` is that from the wall itself; `across` and `turned` are the gates, m and rad.
    """
    taper = min(OVERLAP_TAPER, 1.0 - gates.least_overlap)
    gain = line.gain * match.overlap
    gain *= min(1.0, (match.overlap - gates.least_overlap) / taper)
    gain *= fade(abs(offset), FLAT_GATE * across, across)
    gain *= fade(abs(match.sine), FLAT_GATE * turned, turned)
    return gain


@kernel
def allow_all(scan: Records, possible: Floats) -> None:
    """Write that every scan line may lie on a wall."""
    for i in range(len(scan)):
        possible[i] = scan[i].gain


@kernel
def part_of_match(match: Record) -> float:
    """Return how much of a match there is, 0 to 1, by its score."""
    return min(1.0, match.score / WHOLE_SCORE) if match.wall >= 0 else 0.0


@kernel
def score_of_matches(matches: Records) -> float:
    """Return the sum of the scores of matches (n,), nats."""
    total = 0.0
    for i in range(len(matches)):
        total += matches[i].score
    return total
