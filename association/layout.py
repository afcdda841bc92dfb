"""The records that the kernels speak in, and the tables that they are handed.

Lengths in metres, angles in radians, scores and gains in nats. Poses are in the index frame, from the scan frame. What
a kernel changes besides arrays is a record of an array of length 1. A `NamedTuple` groups the arrays that are handed
on together; a kernel binds those that it needs to names once, outside of its loops, because Numba counts references to
each array that it takes out of a tuple.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from registration.layout import JOINT_SUMS, POSE, SEEN, SYMMETRIC3, Floats, Records

Integers: TypeAlias = NDArray[np.integer[Any]]
Indices: TypeAlias = NDArray[np.intp]
Words: TypeAlias = NDArray[np.uint64]
Flags: TypeAlias = NDArray[np.bool_]

_F, _I = np.float64, np.int64


def _fields(*groups: tuple[type, str]) -> np.dtype[Any]:
    return np.dtype([(name, kind) for kind, names in groups for name in names.split()])


# A point or a direction, and both ends of a segment.
POINT = _fields((_F, "x y"))
ENDS = _fields((_F, "x1 y1 x2 y2"))

# A line of the map, or several joined: unit direction; offset along the left normal; abscissae of begin and end along
# the direction; angle of the direction; the walls before and after it on its run, or -1. One cache line.
WALL = _fields((_F, "dx dy offset begin end angle"), (_I, "before after"))

# A line of the scan, one segment or several that continue or repeat one another, the most telling first: unit
# direction; midpoint; length; angle of the direction; mean of the points and their second moment along the line (m^2);
# variances of offset (m^2) and angle (rad^2) with the model's slack, for the gates; weight in the sums (1/m^2), without
# what is common to a wall; what it is worth on a wall; the sum of that over all later lines; variance of the offset by
# the sigmas alone (m^2); the freedom that it takes from a pose by itself, nats.
SCAN_LINE = _fields(
    (
        _F,
        "dx dy x y length angle centroid_x centroid_y spread offset_variance angle_variance weight gain later_gain "
        "plain_variance freedom",
    ),
)

# What segments of a scan show together that continue or repeat one another: unit direction; midpoint; length from end
# to end, and of what they cover; mean of the points and their second moment along the line (m^2); how many
# they are; variance of its offset (m^2).
LINE_PARTS = _fields((_F, "dx dy x y length covered centroid_x centroid_y spread points variance"))

# Where a scan line lies: the wall or -1; offset from it; sine of the angle to it; share of the length on walls;
# worth of the match.
MATCH = _fields((_I, "wall"), (_F, "offset sine overlap worth"))

# A pose with its covariance, of additive x, y, theta.
ESTIMATE = np.dtype(POSE.descr + SYMMETRIC3.descr)

# What a consensus set is worth, nats: the gains of its pairs; its joint cost, walls' own errors out; the logarithm of
# the freedom that it takes from the pose. The score is gain - cost / 2 - freedom.
VALUE = _fields((_F, "gain cost freedom"))

# What an estimate is worth: its score; the joint cost in it; what the same sums cost at the paper's estimate; length of
# the matched segments; its share of the scan's; the paper's reliability, Eq. (28); mean squared offset over what the
# sigmas alone expect; what lines of sight speak against it, nats; the shares of the beams that read the wall they
# should, and that passed through one, 0 without beams.
MERIT = _fields((_F, "score cost one_step_cost length share reliability misfit blocked read passed"))

# What one wall has in the sums: with the vector ``phi`` and the weight w of each pair, ``sum w phi`` by the names of
# its elements (m and 1 times 1/m^2), ``sum w`` (1/m^2), and the number of pairs.
WALL_SHARE = _fields((_F, "c s x y one weight count"))

# A pose among the best: score and prior together; the score alone.
FOUND = np.dtype([*POSE.descr, ("value", _F), ("score", _F)])

# Geometry of a grid: its corner; the size of a cell; how many there are.
GRID_SHAPE = _fields((_F, "x0 y0 cell"), (_I, "columns rows"))

# What a match has to pass: gates in standard deviations, and the least and greatest offset and angle that they may
# come to; the least share of the length on walls.
GATES = _fields((_F, "sigmas least_offset greatest_offset least_angle greatest_angle least_overlap"))

# What a consensus set is judged by: variance of a wall's own error, m^2; how far a pose is free before it is fixed, as
# standard deviations of position (m) and heading (rad).
MODEL = _fields((_F, "wall_variance free_distance free_angle"))

# Which poses are kept: share of the best value that is needed; distance and angle of distinct poses; share of the best
# value that makes a rival, up to which the search goes on; the value that ends it.
RULES = _fields((_F, "kept_share distinct_distance distinct_angle rival_share enough"))

# What is known before: kind; the pose; radius and angle of a window; information of a Gaussian.
PRIOR = np.dtype([("kind", _I), *POSE.descr, ("radius", _F), ("angle", _F), *SYMMETRIC3.descr])
NO_PRIOR, SOFT_PRIOR, HARD_PRIOR = range(3)

# All of these together.
TERMS = np.dtype([("gates", GATES), ("rules", RULES), ("prior", PRIOR), ("model", MODEL)])

# Two scan segments that fix a pose; the first slides. Merit: the logarithm of what it can tell over what it costs, in
# nanoseconds; that cost; what it is worth at most beside the others that are left; whether its pose is good enough to
# find the rest; how many crossings of the map may fit it, or why that is not known.
BASE = _fields((_I, "sliding crossing"), (_F, "merit cost hope"), (_I, "telling fits"))
NOT_LISTED, NOT_COUNTED = -1, -2  # not all that may fit are on the list; nobody has looked yet

# Where the lines of two runs cross near both: the runs, the second turned to the left of the first by the angle (rad);
# abscissae of their ends from the crossing (m). Rounded: what it tells is tested loosely, and then exactly.
CROSSING = np.dtype(
    [
        ("first", np.int32), ("second", np.int32), ("angle", np.float32),
        ("first_begin", np.float32), ("first_end", np.float32),
        ("second_begin", np.float32), ("second_end", np.float32),
    ]
)  # fmt: skip

# What some crossings come to at best: their angles; the least of their begins and the greatest of their ends.
CROSSING_BLOCK = np.dtype(
    [
        ("least_angle", np.float32), ("greatest_angle", np.float32),
        ("first_begin", np.float32), ("first_end", np.float32),
        ("second_begin", np.float32), ("second_end", np.float32),
    ]
)  # fmt: skip

# How far a search is. Best value and the least value on a full list of best poses, with how many there are; bases gone
# through, poses proposed, poses scored to the end; where to go on: the base or -1, the anchor, the step along it or the
# item of a cell, and the slide or -inf; size of the sets that guide the choice of bases; bound on the gain of a pose
# that contains no base so far; chance of having missed a better consensus set; the freedom that any set takes at least
# whose score would be kept.
PROGRESS = _fields(
    (_F, "best_value least_kept"),
    (_I, "count bases hypotheses verified base anchor step guide"),
    (_F, "slide bound missed least_freedom"),
)

# A pose worked out with the walls' own error estimated: the pose with its covariance; the variance of a wall's error,
# m^2; if walls were off by centimetres, the position's deviation along its weakest direction, m, and that unit
# direction; how far the directions of the walls are from parallel, as a chi-square of their angles.
SETTLED = np.dtype([("pose", ESTIMATE), *_fields((_F, "wall_variance weakest dx dy unlike")).descr])

# What a pose would be without one wall: the wall; by how much it would move, m; the position's deviation along its
# weakest direction, m; the unit direction of the move, or the weakest one where that is not fixed.
HINGE = np.dtype([("wall", _I), *_fields((_F, "moves deviation dx dy")).descr])

# What goes into the variances of scan segments: those of the map's lines and of what shifts neighbouring points
# together, m^2; what those of offset (m^2) and angle (rad^2) come to at least.
VARIANCES = _fields((_F, "map common least_offset least_angle"))

# Where the sensor stood in the scan frame, and whether lines of sight from there are evidence.
VIEW = _fields((_F, "x y"), (_I, "sighted"))

# A ray from a place in the index frame: unit direction; how far it is followed.
RAY = _fields((_F, "x y dx dy limit"))

# How many rays pass through a wall on their way to a segment of the consensus set, and to another one.
BLOCKER = _fields((_I, "to_matched to_clutter"))

# What single beams say of a pose: the shares that read the wall they should, and that passed through one.
BEAM_EVIDENCE = _fields((_F, "read passed"))


class Walls(NamedTuple):
    """Walls or runs, by direction bin and the longest of a bin first.

    Attributes
    ----------
    rows : (m,) of `WALL`
    bin_starts : (bins + 1,) where each bin begins
    longest : (m,) their lengths, metres
    summed : (m + 1,) running sum of `longest`
    """

    rows: Records
    bin_starts: Integers
    longest: Floats
    summed: Floats


# What kernels write to while they look at one pose: the pose; the information of its consensus set, its sums, and what
# it is worth; the end of a beam; a ray; what the beams say. A record that a kernel takes from an array of its own would
# outlive the array, whose last use ends it: hence these come from outside.
SCRATCH = np.dtype(
    [
        ("estimate", ESTIMATE),
        ("information", SYMMETRIC3),
        ("sums", JOINT_SUMS),
        ("value", VALUE),
        ("point", SEEN),
        ("ray", RAY),
        ("evidence", BEAM_EVIDENCE),
    ]
)


class Grid(NamedTuple):
    """A uniform grid with a list for each cell.

    Attributes
    ----------
    shape : (1,) of `GRID_SHAPE`
    starts, items : cell ``c = row * columns + column`` lists ``items[starts[c]:starts[c + 1]]``
    """

    shape: Records
    starts: Integers
    items: Integers


class Raster(NamedTuple):
    """Which directions the walls near a place have.

    Attributes
    ----------
    shape : (1,) of `GRID_SHAPE`
    bits : (columns * rows,) bit s of a cell is set where a wall or a run of direction sector s is near
    """

    shape: Records
    bits: Integers


class Place(NamedTuple):
    """The walls, and where they are: what lies at a point, and what a ray meets."""

    walls: Records
    grid: Grid


class Sweep(NamedTuple):
    """The runs, and where they are: where a base may lie.

    Attributes
    ----------
    runs : (m,) of `WALL`
    bin_starts : (bins + 1,) where each direction bin of the runs begins
    sectors : Grid
        Runs on each cell, ``run * SECTORS + sector``.
    """

    runs: Records
    bin_starts: Integers
    sectors: Grid


class Crossings(NamedTuple):
    """All pairs of runs whose lines cross near both, alike ones side by side.

    Attributes
    ----------
    rows : (k,) of `CROSSING`
    blocks, tops : of `CROSSING_BLOCK`, of so many rows each, and of so many blocks
    reach : float
        Metres; how far from both the crossings are that are listed; none are where it is 0.
    """

    rows: Records
    blocks: Records
    tops: Records
    reach: float


class Corner(NamedTuple):
    """What a crossing has to be at which a base may lie, loosely: the two segments on its first and its second run.

    Attributes
    ----------
    least_angle, greatest_angle : float
        Radians.
    first_begin, second_begin : float
        Metres from the crossing, where the runs begin at most.
    first_end, second_end : float
        Metres from the crossing, where they end at least.
    """

    least_angle: float
    greatest_angle: float
    first_begin: float
    first_end: float
    second_begin: float
    second_end: float


class Pieces(NamedTuple):
    """The map's own segments.

    Attributes
    ----------
    items, starts : wall w consists of segments ``items[starts[w]:starts[w + 1]]``
    ends : (n,) of `ENDS`
    """

    items: Integers
    starts: Integers
    ends: Records


class MapTables(NamedTuple):
    """All that the search reads of a map."""

    place: Place
    sweep: Sweep
    raster: Raster
    crossings: Crossings


class Measured(NamedTuple):
    """Scan segments as they were measured: see `registration.MeasuredSegments`; the first two of `POINT`."""

    directions: Records
    midpoints: Records
    lengths: Floats
    centroids: Records
    spreads: Floats
    sigma: Floats
    points: Floats


class Lines(NamedTuple):
    """The lines of a scan, and the segments that they are made of.

    Attributes
    ----------
    rows : (n,) of `SCAN_LINE`
    row_of : (segments,) which row each segment is part of
    least_overlap : float
        Share of a segment's length that has to lie on a wall.
    """

    rows: Records
    row_of: Indices
    least_overlap: float


class Rays(NamedTuple):
    """Single beams of which something is known.

    Attributes
    ----------
    angles : (m,) radians in the scan frame
    ranges : (m,) metres, inf where nothing was met
    reach : float
        Metres; how far a beam without return is known to be free.
    """

    angles: Floats
    ranges: Floats
    reach: float


class Question(NamedTuple):
    """What is searched for.

    Attributes
    ----------
    scan : (n,) of `SCAN_LINE`
    terms : (1,) of `TERMS`
    """

    scan: Records
    terms: Records


class Blockers(NamedTuple):
    """The walls that rays pass through.

    Attributes
    ----------
    counts : (m,) of `BLOCKER`, by wall
    touched : (m,) the walls that any ray passes through, as many as there are
    """

    counts: Records
    touched: Integers


class Plan(NamedTuple):
    """The bases of a scan, and what tells when enough of them have been gone through.

    Attributes
    ----------
    bases : (k,) of `BASE`
    uses : (n,) how often each of the first n scan segments was part of a base so far
    residual : (all scan segments,) what is left of each gain in the bound, nats
    best_gains : (n,) the gains of the first n, the largest first, nats
    freest : (all scan lines,) those that take most freedom by themselves first
    inliers : (n, n, words) ``[m, i]`` says for 64 samples a word whether segment i is in a set of m + 1
    missing : (n, words) which of these samples have missed all bases so far
    guides, unhit : likewise
        Of other samples, by which bases are chosen: those that were chosen to hit `missing` would show too little left.
    fade : float
        What the logarithm of a base's merit loses for each earlier use of one of its segments.
    random : bool
        Whether the bases are drawn at random.
    guided : bool
        Whether they are chosen by the samples that they hit.
    """

    bases: Records
    uses: Floats
    residual: Floats
    best_gains: Floats
    freest: Integers
    inliers: Words
    missing: Words
    guides: Words
    unhit: Words
    fade: float
    random: bool
    guided: bool


class Workspace(NamedTuple):
    """What the kernels write to while they look at one pose after the other.

    Attributes
    ----------
    matches : (n,) of `MATCH`
    spreads : (n,) angle gates in sectors
    held : (n,) which wall of each scan line is in the sums, or -1
    shares : (m,) of `WALL_SHARE`, by wall; all 0 between two poses
    scratch : (1,) of `SCRATCH`
    """

    matches: Records
    spreads: Floats
    held: Integers
    shares: Records
    scratch: Records

    @classmethod
    def of(cls, count: int, walls: int) -> Workspace:
        """Return one for a scan of `count` lines and a map of that many walls."""
        held = np.full(count, -1, np.int64)
        return cls(np.zeros(count, MATCH), np.zeros(count), held, np.zeros(walls, WALL_SHARE), np.zeros(1, SCRATCH))


def record(dtype: np.dtype[Any], /, **values: float) -> Records:
    """Return an array of one record; what is not named is 0."""
    out = np.zeros(1, dtype)
    for name, value in values.items():
        out[name] = value
    return out


def as_records(dtype: np.dtype[Any], rows: Floats) -> Records:
    """Return the rows of a float array (n, fields) as records (n,), without a copy where it is contiguous."""
    return np.ascontiguousarray(rows, dtype=np.float64).view(dtype).reshape(-1)
