"""Match a scan to the walls at a pose: for each scan line the wall that it lies on best."""

import math

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...index.kernels.walls import fade
from ...tables import Place
from ..tuning import FLAT_GATE, MOST_BRIDGED, OVERLAP_TAPER, WHOLE_SCORE
from .geometry import angle_gate, bins_about, cell_about, offset_gate, rotated
from .wall_chains import Cover, Line, follow_both_ways

SUM_SLACK = 1e-9  # nats, rounding


@kernel
def match_scan(
    scan: Records, estimate: Record, place: Place, gates: Record, possible: Floats, threshold: float, matches: Records
) -> float:
    """Match every scan line to the wall that it lies on best, the lines of the greatest gain first.

    1. List the walls near the midpoint of the line, by the grid (`cell_of`).
    2. Take those of its direction (`bins_about`), within the gates of offset and angle (`lay_on_wall`).
    3. Measure how much of the line they cover, with their neighbours on the chain (`follow_both_ways`).
    4. Keep the one that is least in offset over gate plus missing overlap (`misfit_of`, `write_match`).

    The loops stay together, and the steps take records and numbers: a step that takes arrays costs more than its work,
    because Numba counts references to each.

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
    rotation = (math.cos(estimate.theta), math.sin(estimate.theta))
    total = 0.0
    left = greatest_total(possible)
    for i in range(len(scan)):
        match = matches[i]
        clear_match(match)
        if possible[i] < 0.0:
            continue
        left -= possible[i]
        cell = cell_of(scan[i], estimate, rotation, shape)
        if cell >= 0 and starts[cell] < starts[cell + 1]:
            line, angle = on_map(scan[i], estimate, rotation, gates)
            lowest, highest = bins_about(estimate.theta + scan[i].angle, angle)
            first = bin_starts[lowest]
            end = bin_starts[highest + 1] + (len(walls) if highest < lowest else 0)
            least = 1e300
            to_follow = MOST_BRIDGED
            for k in range(starts[cell], starts[cell + 1]):
                w = items[k]
                if number_from(first, w, len(walls)) >= end:
                    continue
                offset, low, high = lay_on_wall(walls[w], line, 1.0 - 0.5 * angle * angle)
                if high <= low:
                    continue
                cover = (high - low, high - low, 0.0, 0.0)
                if continues(walls[w], low, high, line):
                    cover, to_follow = follow_both_ways(walls, w, line, low, high, to_follow)
                misfit = misfit_of(line, offset, cover)
                if overlap_of(line, cover) >= gates.least_overlap and misfit < least:
                    least = misfit
                    match.wall = w
                    write_match(match, scan[i], line, walls[w], offset, cover, gates, angle)
        total += match.gain
        if total + left < threshold:
            break
    return -1.0 if total < threshold else total


@kernel
def greatest_total(possible: Floats) -> float:
    """Return the greatest possible sum of the gains of all lines (n,), nats."""
    total = SUM_SLACK
    for i in range(len(possible)):
        total += max(0.0, possible[i])
    return total


@kernel
def cell_of(seen: Record, estimate: Record, rotation: tuple[float, float], shape: Record) -> int:
    """Return the number of the grid cell that contains the midpoint of a scan line at a pose, -1 outside of the grid.

    `rotation` is the cosine and the sine of the pose's heading.
    """
    x, y = rotated(seen.x, seen.y, rotation[0], rotation[1])
    return cell_about(shape, x + estimate.x, y + estimate.y)


@kernel
def on_map(seen: Record, estimate: Record, rotation: tuple[float, float], gates: Record) -> tuple[Line, float]:
    """Return a scan line at a pose, with its gate of the offset from a wall; and that of the angle to a wall, rad."""
    c, s = rotation
    x, y = rotated(seen.x, seen.y, c, s)
    dx, dy = rotated(seen.dx, seen.dy, c, s)
    across = offset_gate(seen, estimate, gates, dx * x + dy * y, dx, dy)
    line = (x + estimate.x, y + estimate.y, dx, dy, seen.length, across)
    return line, angle_gate(seen, estimate.tt, gates)


@kernel
def number_from(first: int, w: int, count: int) -> int:
    """Return the number of wall `w` where numbers go on from `first`, after the last of `count` with those from 0 on.

    Walls are numbered by direction: those of about a direction follow one another.
    """
    return w + (count if w < first else 0)


@kernel
def clear_match(match: Record) -> None:
    """Write that a scan line lies on no wall."""
    match.wall = -1
    match.overlap = 0.0
    match.gain = 0.0


@kernel
def lay_on_wall(wall: Record, line: Line, cos_gate: float) -> tuple[float, float, float]:
    """Return the offset of a line from a wall, and between which abscissae from its midpoint it lies on that, metres.

    Beyond its gate, or where the cosine of the angle between both is less than `cos_gate`,
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
def overlap_of(line: Line, cover: Cover) -> float:
    """Return which fraction of a line counts as covered, at most 1."""
    return min(1.0, cover[0] / line[4])


@kernel
def misfit_of(line: Line, offset: float, cover: Cover) -> float:
    """Return the misfit of a line on a wall: its offset from what covers it, over the gate, and the missing overlap."""
    return abs(offset - cover[2] / cover[1]) / line[5] + 1.0 - overlap_of(line, cover)


@kernel
def write_match(
    match: Record,
    seen: Record,
    line: Line,
    wall: Record,
    offset: float,
    cover: Cover,
    gates: Record,
    angle: float,
) -> None:
    """Write how a scan line lies on a wall: at an offset from it, m, where `angle` is the gate of the angle, rad."""
    _, _, dx, dy, _, across = line
    _, covered, aside, squared = cover
    shift = aside / covered
    match.overlap = overlap_of(line, cover)
    match.offset = offset - shift
    match.shift = shift
    match.uneven = max(0.0, squared / covered - shift * shift)
    match.sine = dx * wall.dy - dy * wall.dx
    match.gain = gain_of(seen, match, gates, offset, across, angle)


@kernel
def gain_of(line: Record, match: Record, gates: Record, offset: float, across: float, angle: float) -> float:
    """Return the gain of a match, nats: by the overlap, and nothing at a gate, so that no gate decides.

    `offset` is that from the wall itself; `across` and `angle` are the gates, m and rad.
    """
    taper = min(OVERLAP_TAPER, 1.0 - gates.least_overlap)
    gain = line.gain * match.overlap
    gain *= min(1.0, (match.overlap - gates.least_overlap) / taper)
    gain *= fade(abs(offset), FLAT_GATE * across, across)
    gain *= fade(abs(match.sine), FLAT_GATE * angle, angle)
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
