"""Every threshold of the search and the verdict, by stage, with its unit and where it comes from.

Origins: *geometry* follows from what the number means; *tables* was chosen by the tables of `docs/dev/search.md` on
floor plans and logs, and little changes near it; *measured* is a fit or a timing of what it stands for; *rounding*
keeps arithmetic sound. Coefficients of the verdict are not here: a command fits them, see `verdict.py`.
"""

import math

# --- Walls: from a map's segments to lines, and where they are listed -------------------------------------------------

# Walls that continue one another are tied: a scan segment may lie on both, and they share their error, the less the
# farther apart they are: not at all from these distances on.
WHOLE_GAP = 0.15  # m, geometry: the joint between two pieces of one wall is not wider, and as good as none
APART_GAP = 0.6  # m, geometry: a doorway is wider
APART_STEP = 0.08  # m, tables; the gate within which a segment lies on a wall
DIRECTION_BINS = 90  # tables
SECTOR_BITS = 4
SECTORS = 1 << SECTOR_BITS  # of directions, in the lists by direction; 0 degrees is the middle of one; tables
REACH = 0.4  # m, tables; a wall is listed in the cells this near to it, so gates end here

# --- Scan: the gain of a segment and its variances --------------------------------------------------------------------

# Errors that no sent sigma accounts for: maps drawn or built with some slack, walls that are not quite straight.
MODEL_OFFSET = 0.02  # m, tables; of a wall as a whole,
ROUGHNESS = 0.01  # m, tables; of which that much differs along it
MODEL_ANGLE = math.radians(0.6)  # tables
LOOSE_WALLS = 0.05  # m, tables; by which the walls of a map may be off without its caller's word: drawn maps that the
# verdict's models were fitted to are off by as much
# Gain of a segment found on a wall, over its being clutter: a constant part, and one by length.
GAIN = 6.0  # nats, tables
GAIN_PER_METRE = 2.0  # nats, tables
GAIN_LENGTH = 4.0  # m, tables; beyond it a segment gains no more

# --- Matching: when a scan segment lies on a wall ---------------------------------------------------------------------

GREATEST_ANGLE_GATE = 0.35  # rad, tables

# --- Consensus: growing and shrinking a set of matches at a pose ------------------------------------------------------

# Deviations of a pose before anything fixes it; the log-determinant charges a set for fixing it more sharply. Tables.
FREE_DISTANCE = 0.3  # m
FREE_ANGLE = 0.1  # rad

# --- Proposing: bases, sweeps and slides ------------------------------------------------------------------------------

BASE_SLACK = 0.2  # m, tables; how far a scan segment of a base may stick out at an end of its wall
BASE_SLACK_SHARE = 0.1  # of its length, tables
MIN_CROSSING = 0.1  # sine of the least angle between the walls of a base, tables

# --- Keeping: which poses are remembered ------------------------------------------------------------------------------

COMPLETE_ABOVE = 0.75  # of the best value, tables; a pose above it must not have been missed: the verdict weighs it
# Distinct poses that are kept at least, tables: the verdict compares the best with the others. Of a changed or mirrored
# scan only the best matter, and no more are kept.
FEW_KEPT = 24
DISTINCT_DISTANCE = 0.3  # m, tables
DISTINCT_ANGLE = 0.1  # rad, tables
SOFT_FLOOR = -20.0  # nats, tables; the most that a soft prior speaks against a pose
INSIDE = 1e6  # nats; puts every pose within a hard prior's window before those outside

# --- Lines of sight: which rays are followed --------------------------------------------------------------------------

RAY_SPACING = 0.25  # m, tables; between the points of a segment that rays are sent to
MAX_RAYS = 12  # to one segment, tables
# Walls that are looked at for rays between two looks at the clock, at most: a third of a second. If one pose takes
# more, no ray is followed, and the search is not complete. Measured: scans in their maps take up to 3 million.
MOST_LOOKED_AT = 200_000_000
MOST_RAYS = 1000  # from one pose, about
EMPTY_CELL = 4  # walls, measured; cost of going to the next cell
LATE_CROWD = 500.0  # measured; walls on the list that a place on a wall has, from which rays are left out then
MOST_BEAMS = 180  # tables; of a laser; neighbouring beams say the same
FAR = 25.0  # m, tables; farther walls are looked for only as far as one and a half times the scan reaches
FARTHER = 1.5

# --- Scan and map that differ by a factor, and sensors that turn ------------------------------------------------------

LEAST_OFF_WALLS = 0.01  # m, tables; walls of maps that are declared with less are not compared with walls farther off
MOST_SEARCHES = 3  # tables; with factors and rotations
SUGGESTED = 1.5  # deviations, tables; the scan is searched again with a scale that differs by so much
LEAST_FACTOR, MOST_FACTOR = 0.004, 0.08  # tables; a scan is searched again with a factor that is so far from one
# Nats, by which such a factor has to explain more: 1 map in 100 is off its scale, by up to `MOST_FACTOR` either way, of
# which a scan shows one part in ten. Of 1,089 scans in maps to scale 9 are searched so, in place of 42.
OFF_SCALE = 7.0
DOUBTING_DEVIATIONS = 3.0  # geometry; a distortion beyond them is reported, and a rotation during the scan is believed
LEAST_TURN = math.radians(0.6)  # tables; likewise, if its sensor turned by more during the scan

# --- Reporting --------------------------------------------------------------------------------------------------------

CRITICAL_DISPLACEMENT = (
    0.1  # m, geometry: the finest pose that a robot docks by; a pose that moves less does not depend on one wall
)
SHOWN_TURN = math.radians(1.0)  # tables; a smaller rotation during a scan is not reported
FACING = 0.05  # m, geometry; a wall seen along itself may pass the sensor on either side
# Of the ranges that came back at least that many, and that share, at one value to the digit. In the logs, which give
# centimetres, it is 18 % at most.
LEAST_STUCK = 10
STUCK_SHARE = 0.5  # measured
EXCEEDING = 1.1  # of the map's diagonal, measured; the scans of plans and logs in their own maps come to 1.0
FARTHEST = 300.0  # m, geometry; across what lasers see indoors
LARGEST_MAP = 3000.0  # m, as a map check has it; the diagonal of what robots drive about in
