"""Thresholds of scans, with unit and origin.

Origins: *geometry* follows from what the number means; *tables* was chosen by the tables of `docs/dev/search.md` on
floor plans and logs, and little changes near it; *measured* is a fit or a timing; *rounding* keeps arithmetic sound.
"""

import math

# --- Scan lines -------------------------------------------------------------------------------------------------------

# Segments of a scan that continue or repeat one another are one line, and one piece of evidence. Those that were cut
# from one segment, or that come twice, are joined first, so that nothing else depends on it.
CUT_LATERAL = 1e-4  # m, rounding
CUT_COSINE = 1.0 - 1e-7  # rounding: some 0.03 degrees
LINE_LATERAL = 0.04  # m, tables; how far the middle of one may lie off the line of another,
LINE_ANGLE = math.radians(2.5)  # tables; the angle between them,
LINE_COSINE = math.cos(LINE_ANGLE)
LINE_GAP = 0.3  # m, geometry: as for walls; and along it
# Roughness of a wall and bias of the ranges shift neighbouring points together: no number of points averages it out. It
# decides the angle of short segments, which come with raw ranges.
COMMON_ERROR = 0.008  # m, tables
# Of several views whose poses are not exact: by how many standard deviations more lines of two may lie apart that are
# one, and up to how far.
VIEW_SIGMAS = 1.5  # tables
MOST_LATERAL = 0.12  # m, tables
MOST_TURN = math.radians(6.0)  # tables

# --- Alignment of views before the search -----------------------------------------------------------------------------

ALIGNING_ROUNDS = 3  # tables
ALIGNED_LINES = 40  # tables; of a view, the longest
ALIGNED_VIEWS = 8  # tables; that many views before it a view is laid on
LEAST_ALIGNED = 0.4  # m, tables; that two lines which are one have in common, or half of the shorter
MOST_APART = 0.6  # m, tables; by which they lie apart at most,
MOST_TURNED = 0.3  # sine, tables; and by which they are turned
SAME_LINE = 0.08  # m, tables; two lines of one view that are farther apart cannot both be the line of another
ALIGNING_SHARE = 0.5  # tables; of its information that a seam counts with: seams of one wall have errors in common
VIEWS_APART = 0.1  # m, tables; standard deviation: views from places nearer to each other see about the same

# --- Variances --------------------------------------------------------------------------------------------------------

LEAST_SPREAD = 1e-6  # m^2, rounding
LEAST_VARIANCE = 1e-8  # m^2, rounding

# --- Gates of a correspondence ----------------------------------------------------------------------------------------

GATE_SIGMAS = 3.0  # geometry: 99.7 % of a Gaussian
LEAST_OFFSET_GATE = 0.08  # m, tables
LEAST_ANGLE_GATE = math.radians(4.0)  # tables
LEAST_OVERLAP = 1e-3  # rounding, and as much less than all of a segment: its end may lie on a wall's

# --- Extents ----------------------------------------------------------------------------------------------------------

EXTENT_ANGLES = 18  # directions in which a scan's extent is looked for, geometry
OUTERMOST_SHARE = 0.05  # of a scan's length, measured; at either end it may lie outside of the map

# --- Beams of segments ------------------------------------------------------------------------------------------------

END_MARGIN = 0.06  # m, tables; rays keep this far from the ends of a segment, where neighbours meet
PROBE = 0.3  # m, tables; length of rays to a segment of which it is not known from where it was seen
