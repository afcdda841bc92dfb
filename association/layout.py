"""The records that the kernels exchange; `tables` has the arrays of them that are passed on together.

Lengths in metres, angles in radians, scores and gains in nats. Poses are in the index frame, from the scan frame. In
addition to arrays a kernel changes only records of arrays of length 1.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from registration.layout import JOINT_SUMS, LINE, POSE, SYMMETRIC3, Floats, Records
from registration.layout import record as record

Integers: TypeAlias = NDArray[np.integer[Any]]
Indices: TypeAlias = NDArray[np.intp]
Flags: TypeAlias = NDArray[np.bool_]

_F, _I = np.float64, np.int64


def fields(*groups: tuple[type, str]) -> np.dtype[Any]:
    """Return a record type of groups of fields, each a type and names with spaces between them."""
    return np.dtype([(name, kind) for kind, names in groups for name in names.split()])


# A scan line on a wall, as the estimator takes it: centroid and direction in the scan frame, left normal and offset of
# the wall, when it was seen from -0.5 to 0.5 of the sweep, and how that changes along it, 1/m; second moment of its
# points along it, and variance of its offset by the scan's sigma, m^2; numbers of the wall and of the view.
OBSERVATION = fields(
    (_F, "centroid_x centroid_y dx dy normal_x normal_y offset time pace spread variance"), (_I, "wall of_view")
)

# A point or a direction, and both ends of a segment.
POINT = fields((_F, "x y"))
ENDS = fields((_F, "x1 y1 x2 y2"))

# A line of the map, or several joined: unit direction; offset along the left normal; abscissae of begin and end along
# the direction; angle of the direction; the walls before and after it that are linked to it, or -1. One cache line.
WALL = fields((_F, "dx dy offset begin end angle"), (_I, "before after"))

# A line of the scan, one segment or several that continue or repeat one another, the most informative first: unit
# direction; midpoint; length; angle of the direction; mean of the points and their second moment along the line (m^2);
# variances of offset (m^2) and angle (rad^2) with the model's slack, for the gates; weight in the sums (1/m^2), without
# the error common to a wall; its gain on a wall; variance of the offset by the
# scan's sigmas alone (m^2); the freedom that it alone takes from a pose, nats.
SCAN_LINE = fields(
    (
        _F,
        "dx dy x y length angle centroid_x centroid_y spread offset_variance angle_variance weight gain "
        "plain_variance freedom",
    )
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
# the angle to the wall; fraction of the length on walls; lateral offset of that line from the wall's own (m); the gain
# of the match, and its score, which is the gain less half of the chi-square that goes with it, nats.
MATCH = fields((_I, "wall"), (_F, "offset sine overlap shift gain score"))
# A pose with its covariance, of additive x, y, theta. Bit i, below `MOST_NOTED`, is set where line i of the scan is
# known to lie on no wall.
ESTIMATE = np.dtype([*POSE.descr, *SYMMETRIC3.descr, ("unfit", _I)])
MOST_NOTED = 62
# A scored consensus set, nats: its score, and score and prior together; whether it lies in the window of a hard prior.
SET_SCORE = fields((_F, "score value"), (_I, "inside"))
# The sums of one wall: with the vector ``phi`` and the weight w of each pair, ``sum w phi`` by the names of its
# elements (m and 1 times 1/m^2), ``sum w`` (1/m^2), and the number of pairs. Other evidence of the wall's error than
# these pairs: weight (1/m^2), and weight times the error (1/m) at a pose. A flag for a wall that is listed.
WALL_SUMS = fields((_F, "c s x y one weight count other_weight other_sum"), (_I, "listed"))
# Geometry of a grid: its corner; the size of a cell; how many there are.
GRID_SHAPE = fields((_F, "x0 y0 cell"), (_I, "columns rows"))
# The gates of a match: in standard deviations, and the least and greatest offset and angle that they may come to; the
# least fraction of the length on walls.
GATES = fields((_F, "sigmas least_offset greatest_offset least_angle greatest_angle least_overlap"))
# The model that scores a consensus set: variance of a wall's own error, m^2; how far a pose is free before it is fixed,
# as standard deviations of position (m) and heading (rad); the sensor's place in the scan frame, m.
MODEL = fields((_F, "wall_variance free_distance free_angle sensor_x sensor_y"))
# The prior: kind; the pose; radius and angle of a window; information of a Gaussian.
PRIOR = np.dtype([("kind", _I), *POSE.descr, ("radius", _F), ("angle", _F), *SYMMETRIC3.descr])
NO_PRIOR, SOFT_PRIOR, HARD_PRIOR = range(3)
# The terms by which a pose is judged.
TERMS = np.dtype([("gates", GATES), ("prior", PRIOR), ("model", MODEL)])
# Which poses are refined, nats: those that may reach a fraction of the best value, and a value; the freedom that any
# set takes at least which reaches that. A flag: poses outside the window of a hard prior are dropped.
RULE = fields((_F, "kept_fraction best_value least_value least_freedom"), (_I, "within"))
# The stopping rule, nats: what a set without a base that was drawn gains at most, and what lines gain beyond those of
# bases; the probability of having missed a set; what each use of a line adds to the merits of its bases.
DRAWING_STATE = fields((_F, "bound beyond missed fade"))
# A pose proposed from a base: the pose; cosine and sine of its heading; from the sensor to the point about which it may
# turn, in the scan frame, rotated, and the variance of that rotation.
HYPOTHESIS = np.dtype([*POSE.descr, *fields((_F, "cosine sine lever_x lever_y angle_variance")).descr])
# A scan line at a pose: midpoint, direction, half of its length, m; its gates of offset (m) and angle (rad), and the
# cosine of the latter.
POSED_LINE = fields((_F, "x y dx dy half gate angle_gate least_cosine"))
# What the neighbours of a wall in one direction cover of a line: how far they reach; how much what comes counts; the
# metres that count as covered, and that are; sums over these of the walls' steps from the wall, and of their squares.
WAY = fields((_F, "reach weight net covered first second"))
# The cover of a posed line by a wall and its neighbours on its chain: offset of the line from the wall; abscissae from
# its midpoint between which the wall covers it; the same four sums; those of one direction so far, at their best, and
# of none.
COVER = np.dtype(
    [*fields((_F, "offset low high counted covered first second")).descr, ("way", WAY), ("best", WAY), ("none", WAY)]
)
# A pair whose sums are held: the wall or -1; the weight; the shift of the line under the scan line from the wall; the
# line.
HELD = np.dtype([("wall", _I), ("weight", _F), ("shift", _F), ("line", LINE)])
# A solution of the sums: information of the pose; chi-square; whether the walls are parallel.
SOLUTION = np.dtype([*SYMMETRIC3.descr, ("chi_square", _F), ("parallel", _I)])
# The sums of the outer products of the normals of pairs, weighted by the information of their angles, 1/rad^2.
ANGLE_SUMS = fields((_F, "xx xy yy"))
# Terms of the variances of scan segments: variance of the map's lines, and of the error that neighbouring points share,
# m^2; the least variances of offset (m^2) and angle (rad^2).
VARIANCES = fields((_F, "map common least_offset least_angle"))
# A beam of a laser: where it begins, and its unit direction, in the scan frame; its range, m, inf without a return.
BEAM = fields((_F, "x y dx dy range"))
# The view of a beam on the map: the distance to the first wall; that wall, or -1; the cosine of incidence.
SHOWN = fields((_F, "distance incidence"), (_I, "wall"))
# Records that kernels write to while they look at one pose. A record that a kernel takes from an array of its own would
# outlive the array, whose last use ends it: hence these come from outside.
SCRATCH = np.dtype(
    [
        ("line", POSED_LINE),
        ("cover", COVER),
        ("nothing", JOINT_SUMS),
        ("plain", JOINT_SUMS),
        ("sums", JOINT_SUMS),
        ("angles", ANGLE_SUMS),
        ("common", WALL_SUMS),
        ("solution", SOLUTION),
    ]
)


def as_records(dtype: np.dtype[Any], rows: Floats) -> Records:
    """Return the rows of a float array (n, fields) as records (n,), without a copy where it is contiguous."""
    return np.ascontiguousarray(rows, dtype=np.float64).view(dtype).reshape(-1)
