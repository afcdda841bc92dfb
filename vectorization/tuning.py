"""Every threshold of the vectorizer, by stage."""

import math

# Noise ---------------------------------------------------------------------------------------------------------------

# Standard deviations in metres: taken where the scan is too short to tell, the least that an estimate is believed,
# and how far a wall itself is from straight (also as a share of sigma: beams have a width).
UNKNOWN_SIGMA = 0.02
LEAST_SIGMA = 1e-3
ROUGHNESS = 3e-3
RELATIVE_ROUGHNESS = 0.1

# Share of the triples of points that are trusted to lie on straight walls, and the mean square of that lower share of a
# Gaussian's |z|. A mean, for quantised ranges make a quantile jump.
TRUSTED = 0.5
TRUSTED_MEAN_SQUARE = 0.14262

# Points in a window where noise has no direction, and the median of chi-square of its five degrees of freedom over 5.
WINDOW = 7
MEDIAN_CHI = 0.8703

# Triples or windows, for an estimate.
LEAST_TRIPLES = 10

# Steps between neighbouring rays whose three ranges make a triple.
TRIPLE_STEPS = 1.6

# Ranges are quantised when all are multiples of a step of so many of these units (m), to this share of a unit.
QUANTUM_UNIT = 1e-4
LEAST_QUANTUM = 10
QUANTUM_SLACK = 0.1

# Gaps ----------------------------------------------------------------------------------------------------------------

# Angle between ray and wall below which consecutive points need not be taken for neighbours, and beams that may miss.
GRAZING = math.radians(10.0)
MISSING_STEPS = 4.5

# Standard deviations that neighbours may be apart beyond what their rays explain.
GAP_NOISE = 4.0

# Points without rays are neighbours up to this many median spacings.
SPACINGS = 6.0

# Angle (rad) between rays that is assumed at least.
LEAST_INCREMENT = 1e-6

# Order ---------------------------------------------------------------------------------------------------------------

# Steps are compared with the usual step between beams: this quantile of so many steps around. It allows for points that
# come three times and for a few gaps. Points are repeated where the steps below REPEATED are that fraction of all, and
# VALLEY_DEPTH times as frequent as those from VALLEY to REPEATED_STEP, by so many standard deviations of the counts.
# Points that are spaced at random, as in a subsample of a cloud, have 1.6 times as many. If points are repeated,
# those nearer than REPEATED_STEP are left out. Measured on drawn scans with each point two or three times: repeats are
# found up to a scatter of a sixth of the points' spacing, in most scans up to a third.
SAME_BEAM = 0.8
STEP_WINDOW = 31
REPEATED = 0.2
REPEATED_SHARE = 0.15
VALLEY = 0.3
VALLEY_DEPTH = 1.8
DEVIATIONS = 4.0
REPEATED_STEP = 0.5

# Standard deviations that two readings of one beam are apart at most.
REPEATED_NOISE = 8.0

# Least number of points whose order is checked; steps (rad) that noise may make in either direction; passes over the
# covered angle.
LEAST_ORDERED = 12
JITTER = 0.05
MOST_PASSES = 1.5

# Points whose nearest is looked for, and how many times farther than that the next may lie, both in the median.
PROBES = 64
SCATTERED = 6.0

# Pieces --------------------------------------------------------------------------------------------------------------

# The farthest point's distance from the chord, in standard deviations, from which on a stretch is split there.
CHORD_GATE = 3.5

# Minimum reduction of the chi-square by a further break: two parameters of a line and the choice of the break's place.
BREAK_PENALTY = 20.0

# Maximum shift of a break in points, and number of places at which a break in an even stretch is tried.
BREAK_REACH = 8
BREAK_TRIALS = 24

# Points in a stretch that a break is tried in, and on either side of it.
LEAST_BROKEN = 8
LEAST_SIDE = 3

# Times that breaks are settled and pieces merged again.
SETTLING_ROUNDS = 3

# Lines ---------------------------------------------------------------------------------------------------------------

# Standard deviations within which a point is taken for the line's own.
POINT_GATE = 3.5

# Points of a line: two fix it, one is there to say how well.
LEAST_POINTS = 3

# Steps of a fit, and the square of one, in standard deviations, after which the next would be lost in rounding.
FIT_STEPS = 5
SETTLED = 1e-8

# Standard deviations of chi-square by which it may exceed its mean before the noise is taken for larger than given.
WIDENING = 3.0

# Cosine of incidence below which a ray says too little of where it meets the line.
LEAST_COSINE = 0.03

# Points and steps between rays that may lie between two pieces of one line, and metres that it may be extended over.
SKIPPED = 4
SKIPPED_STEPS = 6.5
LONGEST_STEP = 1.5

# Root mean square distance (m) between one line and two below which the break is no feature: plaster, and a range
# finder's bias that changes with range and incidence, bend straight walls by as much.
FLATNESS = 5e-3

# Sine of the angle between two lines above which they are not tried for being one, and how often the one is fitted:
# started from one part's line, its gate may miss the other's far points at first.
NEAR_PARALLEL = 0.2
JOINT_FITS = 3

# A line is extended while its own variance is at most this many times that of a point.
WORST_KNOWN = 4.0

# A line is kept when its angle is known to this standard deviation (rad) and its chi-square per degree of freedom is
# at most this: a heap of points is no wall.
WORST_ANGLE = 0.12
WORST_FIT = 6.0

# Standard deviations within which the last point of a line belongs to it: beyond, an object next to the wall begins.
END_GATE = 2.0

# Corners -------------------------------------------------------------------------------------------------------------

# Sine of the angle between two lines below which they have no corner, and how much farther than to the next beam an
# end may be moved to reach one, past so many points at most.
LEAST_CORNER = 0.15
CORNER_REACH = 1.6
CORNER_BEAMS = 3

# Times that two lines share the points about their corner.
SHARING_ROUNDS = 2
