"""The records that the kernels exchange; `tables` has the arrays of them that are passed on together.

Lengths in metres, angles in radians, scores and gains in nats. Poses are in the index frame, from the scan frame. In
addition to arrays a kernel changes only records of arrays of length 1.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from registration.layout import JOINT_SUMS, POSE, SEEN, SYMMETRIC3, Floats, Records
from registration.layout import record as record

Integers: TypeAlias = NDArray[np.integer[Any]]
Indices: TypeAlias = NDArray[np.intp]
Flags: TypeAlias = NDArray[np.bool_]

_F, _I = np.float64, np.int64


def fields(*groups: tuple[type, str]) -> np.dtype[Any]:
    """Return a record type of groups of fields, each a type and names with spaces between them."""
    return np.dtype([(name, kind) for kind, names in groups for name in names.split()])


# A point or a direction, and both ends of a segment.
POINT = fields((_F, "x y"))
ENDS = fields((_F, "x1 y1 x2 y2"))

# A line of the map, or several joined: unit direction; offset along the left normal; abscissae of begin and end along
# the direction; angle of the direction; the walls before and after it that are linked to it, or -1. One cache line.
WALL = fields((_F, "dx dy offset begin end angle"), (_I, "before after"))

# A line of the scan, one segment or several that continue or repeat one another, the most informative first: unit
# direction; midpoint; length; angle of the direction; mean of the points and their second moment along the line (m^2);
# variances of offset (m^2) and angle (rad^2) with the model's slack, for the gates; weight in the sums (1/m^2), without
# the error common to a wall; its gain on a wall; the sum of that over all later lines; variance of the offset by the
# scan's sigmas alone (m^2); the freedom that it alone takes from a pose, nats.
SCAN_LINE = fields(
    (
        _F,
        "dx dy x y length angle centroid_x centroid_y spread offset_variance angle_variance weight gain later_gain "
        "plain_variance freedom",
    ),
)

# A line of segments of a scan that continue or repeat one another: unit direction; midpoint; length from end to end,
# and the length that they cover; mean of the points and their second moment along the line (m^2); the number of points,
# and the standard deviation of one of them (m); variance of its offset (m^2); uncertainty of the viewpoints, as
# variances of the offset (m^2) and the angle (rad^2).
LINE_PARTS = fields(
    (_F, "dx dy x y length covered centroid_x centroid_y spread points sigma variance common_offset common_angle")
)

# The part of a line of the scan that one view shows: number of the view's sensor; the row of that line; unit direction;
# midpoint; length; mean of the points and their second moment along the line (m^2); variance of its offset (m^2).
SIGHTING = fields((_I, "sensor row"), (_F, "dx dy x y length centroid_x centroid_y spread variance"))

# The match of a scan line: the wall or -1; offset from the line under it, which tied walls make up together; sine of
# the angle to the wall; fraction of the length on walls; lateral offset of that line from the wall's own (m), and the
# mean square by which the walls under it are off it (m^2); the gain of the match, and its score, which is the gain less
# half of the chi-square that goes with it, nats.
MATCH = fields((_I, "wall"), (_F, "offset sine overlap shift uneven gain score"))

# A pose with its covariance, of additive x, y, theta.
ESTIMATE = np.dtype(POSE.descr + SYMMETRIC3.descr)

# The terms of a score, nats: the gains of the pairs; their chi-square, walls' own errors taken out; the log-determinant
# of what they fix of the pose. The score is gain - chi_square / 2 - log_determinant.
SCORE_TERMS = fields((_F, "gain chi_square log_determinant"))

# A scored consensus set: its score; the chi-square in it; that of the same sums at the paper's estimate; length of the
# matched segments; its fraction of the scan's; mean squared offset over what the scan's sigmas alone expect; the
# penalty of lines of sight, nats; the fractions of the beams that read the wall they should, and that passed through
# one, 0 without beams; how many rows are matched.
SET_SCORE = fields(
    (_F, "score chi_square one_step_chi_square length fraction misfit blocked read passed count"),
)

# The sums of one wall: with the vector ``phi`` and the weight w of each pair, ``sum w phi`` by the names of its
# elements (m and 1 times 1/m^2), ``sum w`` (1/m^2), and the number of pairs. Other evidence of the wall's error than
# these pairs: weight (1/m^2), and weight times the error (1/m) at a pose. A flag for a wall that is listed.
WALL_SUMS = fields((_F, "c s x y one weight count other_weight other_sum"), (_I, "listed"))

# A pose among the best: score and prior together; the score alone.
FOUND = np.dtype([*POSE.descr, ("value", _F), ("score", _F)])

# Geometry of a grid: its corner; the size of a cell; how many there are.
GRID_SHAPE = fields((_F, "x0 y0 cell"), (_I, "columns rows"))

# The gates of a match: in standard deviations, and the least and greatest offset and angle that they may come to; the
# least fraction of the length on walls.
GATES = fields((_F, "sigmas least_offset greatest_offset least_angle greatest_angle least_overlap"))

# The model that scores a consensus set: variance of a wall's own error, m^2; how far a pose is free before it is fixed,
# as standard deviations of position (m) and heading (rad).
MODEL = fields((_F, "wall_variance free_distance free_angle"))

# Rules by which poses are stored: fraction of the best value that is needed; distance and angle of distinct poses;
# fraction of the best value that makes an alternative, up to which the search goes on; the value that ends it.
RULES = fields((_F, "kept_share distinct_distance distinct_angle rival_share enough"))

# The prior: kind; the pose; radius and angle of a window; information of a Gaussian.
PRIOR = np.dtype([("kind", _I), *POSE.descr, ("radius", _F), ("angle", _F), *SYMMETRIC3.descr])
NO_PRIOR, SOFT_PRIOR, HARD_PRIOR = range(3)

# The terms by which a pose is judged.
TERMS = np.dtype([("gates", GATES), ("prior", PRIOR), ("model", MODEL)])

# The geometry of a base for its search, of its segments a, which slides, and b: from the midpoint of a to that of b,
# also along a and to its left, and the angle between them; the point about which a pose turns, and the variance of its
# rotation; the tolerance of the two angles; by how much the rotation may be off until the final one is known, and by
# how many metres b then is; half of the length that has to lie within its chain, of a and of b.
FIGURE = fields((_F, "x y ahead beside turn pin_x pin_y angle_variance tolerance slip swing half_a half_b"))

# A pose proposed from a base: the pose; cosine and sine of its heading; from the sensor to the point about which it may
# turn, in the scan frame, rotated, and the variance of that rotation; the prior's bonus to its score, and the
# least score that it needs; whether it may score that.
HYPOTHESIS = np.dtype(
    [
        *POSE.descr,
        *fields((_F, "cosine sine lever_x lever_y angle_variance bonus floor"), (_I, "possible")).descr,
    ]
)

# An estimated pose, with the walls' own error estimated: the pose with its covariance; the variance of a wall's error,
# m^2; if walls were off by centimetres, the position's deviation along its weakest direction, m, and that unit
# direction; whether they are parallel by their reliability.
ESTIMATED = np.dtype([("pose", ESTIMATE), *fields((_F, "wall_variance weakest dx dy"), (_I, "parallel")).descr])

# A pose among walls of which each has its own error, with that standard deviation, m.
POSE_AMONG_WALLS = fields((_F, "theta x y wall_sigma"))

# A pose as it would be without one wall and the walls tied to it: the wall; by how much the pose would move, m; the
# position's deviation along its weakest direction, m; the unit direction of the move, or the weakest one if that is not
# fixed; how far the wall counts as one of its own, next to those that it is tied to, 0 to 1.
LEVERAGE = np.dtype([("wall", _I), *fields((_F, "displacement deviation dx dy own")).descr])

# Terms of the variances of scan segments: variance of the map's lines, and of the error that neighbouring points share,
# m^2; the least variances of offset (m^2) and angle (rad^2).
VARIANCES = fields((_F, "map common least_offset least_angle"))

# A ray from a place in the index frame: unit direction; how far it is followed.
RAY = fields((_F, "x y dx dy limit"))

# A beam of a laser: where it begins, and its unit direction, in the scan frame; its range, m, inf without a return.
BEAM = fields((_F, "x y dx dy range"))

# The rays through a wall: their number to segments of the consensus set, and to other segments. While they are
# counted: the scan line that the last one goes to, from 1 up; the view it comes from; how many go from there to that
# line, and how many at most from any view.
BLOCKER = fields((_I, "to_matched to_clutter row sensor here most"))

# Evidence of single beams at a pose: the fractions that read the wall they should, and that passed through one.
BEAM_EVIDENCE = fields((_F, "read passed"))

# An explanation as it is compared with others: score and prior together, nats; the chi-square in the score; how many
# rows are matched. And of an alternative: by how much its evidence is greater than that of the best, nats, with walls
# as far off as they may be; how far it counts, 0 to 1: fully where the search cannot have missed one as good.
COMPARED = fields((_F, "posterior chi_square count"))
ALTERNATIVE = fields((_F, "gap counted"))

# Facts of an answer in addition to its score: the position's deviation along its weakest direction, and by how much it
# would move without one wall and its deviation then, m; how many walls hold a match; fraction of directions in which
# the scan shows what the map does; fractions of the beams that read farther, and nearer, than the map shows, that
# passed through a wall; length of the longest segment that is not matched, and of all of these that are as long as
# walls, m.
FACTS = fields(
    (
        _F,
        "weakest critical_displacement critical_deviation walls agreement farther nearer passed longest "
        "unmatched_walls",
    )
)

# A scan segment of a consensus set in the map's own pieces: the piece that it lies on most, -1 where it is none of the
# set, and how many others are named; the fraction of its length that lies on any.
PAIR = fields((_I, "piece others"), (_F, "overlap"))

# The term of a verdict's model for one feature, nats: which feature; where its bends begin and end; nats per unit of it
# below the first of them. From `start` on the slope is more by `more`.
CURVE = fields((_I, "feature begin end"), (_F, "slope"))
BEND = fields((_F, "start more"))

# Its term for two features together: which; 1 where the lesser fraction counts, 0 for the greater; nats; for each
# the value from which it speaks for the answer, and that at which it does in full.
TWO_FEATURES = fields((_I, "first second least"), (_F, "nats start full second_start second_full"))

# The sums of the outer products of the normals of pairs, weighted by the information of their angles, 1/rad^2: see
# `consensus.kernels.reliability`.
ANGLE_SUMS = fields((_F, "xx xy yy"))

# Records that kernels write to while they look at one pose: the pose; the information of its consensus set; its sums,
# without the walls' errors and with them; the sums of its angles; a line; the other evidence of the error of walls that
# are tied; the terms of its score; the end of a beam; a ray; the evidence of the beams; the geometry of a base. A
# record that a kernel takes from an array of its own would outlive the array, whose last use ends it: hence these come
# from outside.
SCRATCH = np.dtype(
    [
        ("estimate", ESTIMATE),
        ("information", SYMMETRIC3),
        ("sums", JOINT_SUMS),
        ("plain", JOINT_SUMS),
        ("angles", ANGLE_SUMS),
        ("line", WALL),
        ("common", WALL_SUMS),
        ("terms", SCORE_TERMS),
        ("point", SEEN),
        ("ray", RAY),
        ("evidence", BEAM_EVIDENCE),
        ("figure", FIGURE),
    ]
)


def as_records(dtype: np.dtype[Any], rows: Floats) -> Records:
    """Return the rows of a float array (n, fields) as records (n,), without a copy where it is contiguous."""
    return np.ascontiguousarray(rows, dtype=np.float64).view(dtype).reshape(-1)
