"""Every threshold of the map check, by stage; each with its unit, and where it comes from.

"Geometry" follows from the measured quantity, "tables" was looked up in plans and drawn worlds. The check finds nothing
where these are right, and something where they were spoilt.
"""

import math

# --- Pieces -----------------------------------------------------------------------------------------------------------

SHORT = 0.1  # m, tables; a wall shorter than that is no evidence for a search
LEAST_GAP, GREATEST_GAP = 0.02, 0.1  # m, tables; between ends that meet and a slit that was drawn on purpose
GAP_SIGMAS = 4.0  # of the declared deviation of the map, geometry; ends that are nearer to each other than that meet
MOST_ENDS = 20_000  # that are looked about from, some 10 microseconds each
OVERLAP = 0.05  # m, tables; pieces of one line share less than that where they are cut
PARALLEL = math.sin(math.radians(3.0))  # tables
SAME_LINE = 0.03  # m, as `MERGE_LATERAL`; lines nearer to each other than that are one
DOUBLE = 0.3  # m, tables; two faces that look one way, or at each other, are not so near in a building
DOUBLE_LENGTH = 0.3  # m, and this share of the shorter, tables; over which they run next to each other
DOUBLE_SHARE = 0.5
MOST_IN_CELL = 64  # walls of one cell that are compared with each other
MOST_PAIRS = 16_000_000  # time, some 0.1 microseconds each; a pair counts once for each cell that lists it
PAIRS_AT_A_TIME = 100_000  # memory, some 20 MB; and time, between two looks at the deadline
ON_STEP = 1e-6  # m, rounding
LARGEST_PIXEL, MANY_ENDS = 0.1, 50  # m, and segments, tables; of a map that was traced from a picture
STEPS = (0.5, 0.25, 0.2, 0.1, 0.05, 0.04, 0.025, 0.02)  # m; rasters that are looked for; finer ones do no harm

# --- Sides ------------------------------------------------------------------------------------------------------------

MOST_LOOKED_FROM, WALLS_TIMES_SEGMENTS = 2000, 40_000_000  # walls, the longest; time, some 0.2 to 2 ms each
SHORTEST_LOOKED_FROM = 0.3  # m, tables
PLACES_ON_A_WALL = (0.25, 0.5, 0.75)  # of its length
RAYS_FROM_A_PLACE = 4
FAN = (math.radians(-60.0), math.radians(40.0))  # first angle and step of these, from the wall's normal
OFF_THE_WALL = 1e-3  # m, geometry
FOLLOWED = 40.0  # m, tables
TOO_NEAR = 0.05  # m, geometry; a hit that is nearer is the same wall again
CONTRADICTED = 0.5  # of a wall's rays on one side
# Of hits of rays. Measured: up to 0.07 in drawings of plans, 0.30 in campus plans, 0.39 in maps that robots made; from
# 0.41 on where directions were thrown away.
MEANINGLESS = 0.4
MOST = 0.55  # of the length, measured: 0.42 at most in plans, from 0.60 on in most of them the other way round

# --- Likeness ---------------------------------------------------------------------------------------------------------

PLACES = 12  # tables
RAYS = 360
REACH = 12.0  # m, tables; of the laser that is thought of
SIGMA = 0.01  # m

# --- Size -------------------------------------------------------------------------------------------------------------

LONGEST_USUAL = 30.0  # m, tables; half of the length of 443 maps is in walls of 0.6 to 21.9 m and more
SMALLEST, LARGEST = 2.0, 3000.0  # m, tables; the diagonal of what robots drive about in

# --- Samples ----------------------------------------------------------------------------------------------------------

SIGMAS = (0.05, 0.1, 0.2)  # m, tables; tried in addition to the map's own: half the thickness of walls, or more
WIDEST = max(SIGMAS)
CONFIDENCE = 0.99  # tables; of a search under a hypothesis
LITTLE = 0.01  # m, tables; the estimate where walls are right
BETTER_SCORE = 1.15  # times, tables
BETTER_USABLE = 0.15  # of the scans, tables
MANY = 0.5  # of the scans that give evidence
MOVED_METRES, MOVED_RADIANS = 0.2, math.radians(2.0)  # tables; less than that may be the poses that were sent
LEAST_SIGMA, GREATEST_SIGMA = 0.005, 1.0  # m
MOST_SCANS, MOST_LINES = 10, 20_000  # scans, and segments, whose scale and thickness are searched for; time

# --- Scale ------------------------------------------------------------------------------------------------------------

LADDER = tuple(1.1**k for k in range(-17, 18))  # 0.2 to 5, tables; factors by which the map is tried to be off
LAX_TOLERANCE = 0.4  # m, tables; of offsets, so that scans off by half a rung find the walls near them
MOST_ON_LADDER = 4  # scans; time
LEAST_SCALE = 0.004  # tables; a factor that is reported differs from one by this,
DEVIATIONS = 3.0  # and by so many of its deviations
SAME_FACTOR = 0.0015  # tables; factors no farther apart mean one scale; those of walls too thick differ by room
LEAST_EXTENT = 1.5  # m, geometry; the part seen of any room
GREATEST_EXTENT = 60.0  # m, tables; a larger scan is of another unit itself
EXCEEDING = 1.1  # of the map's diagonal, measured; the scans of plans and logs in their own maps come to 1.0

# --- Thickness --------------------------------------------------------------------------------------------------------

THICKNESS_SIGMA = SIGMAS[0]  # of the trials that show it, tables
LEAST_THICKER = 0.03  # m, tables
SAME_THICKNESS = 0.03  # m, tables; of scans that agree
