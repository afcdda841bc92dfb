"""Compiled sweeps: where the second segment of a base comes to lie while the first one slides along a wall chain.

In stages, each for many chains at once, so that the processor need not wait for one result before the next.
"""

import math

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...consensus.kernels.geometry import wrap
from ...consensus.kernels.raster import PER_RADIAN, sectors_about
from ...layout import HARD_PRIOR, Integers
from ...tables import Grid
from ...tuning import BASE_SLACK, BASE_SLACK_SHARE, MIN_CROSSING, SECTOR_BITS, SECTORS
from ..tuning import WINDOW_MARGIN, WINDOW_TURN


@kernel
def end_slack(length: float) -> float:
    """Return how far a scan segment, as part of a base, may stick out at each end of its wall."""
    return BASE_SLACK + BASE_SLACK_SHARE * length


@kernel
def least_length(length: float) -> float:
    """Return how long a wall is at least under a scan segment of a base."""
    return length - 2.0 * end_slack(length)


@kernel
def angle_tolerance(a: Record, b: Record, gates: Record) -> float:
    """Return by how much the angle between two scan segments may differ from that between their chains."""
    variance = a.angle_variance + b.angle_variance
    return min(gates.greatest_angle, max(gates.least_angle, gates.sigmas * math.sqrt(variance)))


@kernel
def anchors(length: float, lengths: Floats, out: Integers) -> int:
    """List the chains, of `lengths` (m,), that are long enough for a scan segment of `length` metres; count them."""
    n = 0
    need = least_length(length)
    for w in range(len(lengths)):
        out[n] = w
        n += 1 if lengths[w] >= need else 0
    return n


@kernel
def measure(a: Record, b: Record, gates: Record, figure: Record) -> None:
    """Write the figure of a base of the scan segments a, which slides, and b.

    The final angle splits the misfit of both, so that b turns about a by up to `swing` metres.
    """
    va = a.angle_variance
    vb = b.angle_variance
    figure.x = b.x - a.x
    figure.y = b.y - a.y
    figure.ahead = a.dx * figure.x + a.dy * figure.y
    figure.beside = a.dx * figure.y - a.dy * figure.x
    figure.turn = b.angle - a.angle
    figure.pin_x = 0.5 * (a.x + b.x)
    figure.pin_y = 0.5 * (a.y + b.y)
    figure.angle_variance = va * vb / (va + vb)
    figure.tolerance = angle_tolerance(a, b, gates)
    figure.slip = figure.tolerance * va / (va + vb)
    figure.swing = figure.slip * math.hypot(figure.x, figure.y) / abs(math.sin(figure.turn))
    figure.half_a = 0.5 * a.length - end_slack(a.length) - figure.swing
    figure.half_b = 0.5 * b.length - end_slack(b.length) - figure.swing


@kernel
def lay(
    figure: Record, a: Record, b: Record, prior: Record, chains: Records, shape: Record, anchors: Integers,
    laid: Records,
) -> None:  # fmt: skip
    """Lay a on the begins of chains, `anchors` (k,), and write to `laid` (k,) where b is then in the grid."""
    windowed = prior.kind == HARD_PRIOR
    widest = prior.angle + WINDOW_TURN + figure.tolerance
    near_x = math.cos(prior.theta) * a.x - math.sin(prior.theta) * a.y + prior.x
    near_y = math.sin(prior.theta) * a.x + math.cos(prior.theta) * a.y + prior.y
    lever = 2.0 * math.hypot(a.x, a.y) * math.sin(0.5 * min(widest, math.pi))
    window = prior.radius + WINDOW_MARGIN + lever + figure.swing
    spread = figure.tolerance * PER_RADIAN
    for j in range(len(anchors)):
        chain = chains[anchors[j]]
        one = laid[j]
        one.chain = anchors[j]
        lay_on(figure, a, b, chain, one)
        one.sectors = sectors_about((chain.angle + figure.turn + math.pi) * PER_RADIAN + 0.5, spread)
        if windowed:
            # A hard prior limits the midpoint of a.
            away = chain.dx * near_y - chain.dy * near_x - chain.offset
            along = chain.dx * near_x + chain.dy * near_y
            one.at = max(one.at, along - window)
            one.high = min(one.high, along + window)
            if abs(away) > window or abs(wrap(chain.angle - a.angle - prior.theta)) > widest:
                one.high = -math.inf
        enter_grid(one, shape)


@kernel
def lay_on(figure: Record, a: Record, b: Record, chain: Record, one: Record) -> None:
    """Write where b lies, and how far a can slide, with a on a chain."""
    dx = chain.dx
    dy = chain.dy
    # Rotation that lays a on the chain, and the direction that b then has.
    c = dx * a.dx + dy * a.dy
    s = dy * a.dx - dx * a.dy
    one.dx = dx
    one.dy = dy
    one.b_dx = c * b.dx - s * b.dy
    one.b_dy = s * b.dx + c * b.dy
    # Midpoint of b with the midpoint of a at abscissa 0 of the chain; the slide is that abscissa.
    one.x = c * figure.x - s * figure.y - dy * chain.offset
    one.y = s * figure.x + c * figure.y + dx * chain.offset
    one.at = chain.begin + figure.half_a
    one.high = chain.end - figure.half_a


@kernel
def enter_grid(one: Record, shape: Record) -> None:
    """Write in which cell b begins its way through a grid, and where it comes to the next column and row."""
    per_cell = 1.0 / shape.cell
    cell = shape.cell
    at = one.at
    fx = (one.x + at * one.dx - shape.x0) * per_cell
    fy = (one.y + at * one.dy - shape.y0) * per_cell
    column = math.floor(fx)
    row = math.floor(fy)
    one.column = column
    one.row = row
    right = one.dx > 0.0
    up = one.dy > 0.0
    one.step_x = 2 * right - 1
    one.step_y = 2 * up - 1
    one.pace_x = cell / max(abs(one.dx), 1e-12)
    one.pace_y = cell / max(abs(one.dy), 1e-12)
    one.next_x = at + (right + (1 - 2 * right) * (fx - column)) * one.pace_x
    one.next_y = at + (up + (1 - 2 * up) * (fy - row)) * one.pace_y


@kernel
def sweep(laid: Records, first: int, count: int, present: Integers, shape: Record, swept: Records) -> tuple[int, int]:
    """Write the cells that b sweeps and that list chains of its direction, from the `first` of `count` laid ones on.

    Returns with which of these it stopped because `swept` (k,) was full, or `count`, and the number of cells. The
    records of `laid` store their progress.
    """
    columns = shape.columns
    rows = shape.rows
    n = 0
    for j in range(first, count):
        one = laid[j]
        at = one.at
        high = one.high
        column = one.column
        row = one.row
        next_x = one.next_x
        next_y = one.next_y
        while at <= high and n < len(swept):
            until = min(next_x, next_y)
            inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
            here = row * columns + column if inside else 0
            swept[n].laid = j
            swept[n].here = here
            swept[n].at = at
            swept[n].until = until
            n += 1 if inside & ((present[here] & one.sectors) != 0) else 0
            at = until
            # Without a branch, which would be as often one way as the other.
            sideways = 1 if next_x < next_y else 0
            column += sideways * one.step_x
            row += (1 - sideways) * one.step_y
            next_x += sideways * one.pace_x
            next_y += (1 - sideways) * one.pace_y
        if at <= high:
            one.at = at
            one.column = column
            one.row = row
            one.next_x = next_x
            one.next_y = next_y
            return j, n
    return count, n


@kernel
def meet(
    laid: Records, swept: Records, first: int, begin: int, count: int, sectors: Grid, met: Records
) -> tuple[int, int, int]:
    """Write the chains that have the direction of b, of the cells swept from the `first` of `count` on.

    Of that one from the entry `begin` of its list on. Returns in which cell, and at which entry, it stopped because
    `met` (k,) was full, or `count` and 0, and the number of chains.
    """
    starts = sectors.starts
    items = sectors.items
    n = 0
    for cell in range(first, count):
        one = swept[cell]
        wanted = laid[one.laid].sectors
        start = starts[one.here]
        for k in range(start + begin, starts[one.here + 1]):
            if n == len(met):
                return cell, k - start, n
            met[n].number = items[k] >> SECTOR_BITS
            met[n].cell = cell
            n += (wanted >> (items[k] & (SECTORS - 1))) & 1
        begin = 0
    return count, 0, n


@kernel
def where_crossed(figure: Record, laid: Records, swept: Records, met: Records, count: int, chains: Records) -> int:
    """Pick of the first `count` chains that were met those that b lies on where it crosses them; return how many.

    A chain is listed in several cells: it counts where the crossing is. The ends are tested loosely, for the final
    angle is not known. ``hit`` of the first of `met` has their places.
    """
    n = 0
    least_cos = 1.0 - 0.5 * figure.tolerance * figure.tolerance
    half = figure.half_b
    for k in range(count):
        cell = swept[met[k].cell]
        one = laid[cell.laid]
        chain = chains[met[k].number]
        met[n].hit = k
        across = chain.dx * one.dy - chain.dy * one.dx
        if chain.dx * one.b_dx + chain.dy * one.b_dy < least_cos or abs(across) < MIN_CROSSING:
            continue
        slide = (chain.offset - chain.dx * one.y + chain.dy * one.x) / across
        along = chain.dx * (one.x + slide * one.dx) + chain.dy * (one.y + slide * one.dy)
        here = (slide >= cell.at) & (slide < cell.until) & (slide <= one.high)
        n += 1 if here & (along - half >= chain.begin) & (along + half <= chain.end) else 0
    return n
