"""Every threshold of matching, scoring and estimating consensus sets, with its unit and where it comes from.

The origins are explained in `association.tuning`.
"""

from ..tuning import GAIN

# --- Matching: when a scan segment lies on a wall ---------------------------------------------------------------------

# Between these lengths a segment comes to bridge a gap between walls: a short one may well be clutter there.
SHORT_BRIDGE, LONG_BRIDGE = 2.5, 3.5  # m, tables
FLAT_STEP = 0.03  # m, tables; between two walls on which a segment lies, up to where both count fully
FLAT_GATE = 0.9  # of a gate, tables; a line farther off gains less, and nothing at the gate
OVERLAP_TAPER = 0.05  # beyond the least overlap, tables; up to there a match gains less, and nothing at the least
WHOLE_SCORE = 2.0  # nats, tables; a match that scores less is a match in part
MOST_BRIDGED = 2000  # neighbours on their chains that the walls under one scan segment have, measured

# --- Consensus: growing and shrinking a set of matches at a pose ------------------------------------------------------

ROUNDS = 3  # tables; of matching and solving
MAX_STEP = 1.0  # m, tables; a consensus set that moves its pose farther than that, or
MAX_TURN = 0.2  # rad, tables; is not the one that the pose was proposed for
SAME_SHIFT = 1e-6  # m, rounding
SPRING = 1e-2  # 1/m^2; holds a pose along directions that no pair fixes, with 10 m of standard deviation
START_VARIANCE = 1e-4  # m^2, tables; of a pose that comes without a covariance
START_ANGLE_VARIANCE = 1e-6  # rad^2, tables

# --- Work between two looks at the clock ------------------------------------------------------------------------------

# Work between two looks at the clock while poses are ranked: poses, times segments of the scan, times walls on the list
# of a place. More than all poses of a usual search, and some seconds where thousands of walls lie in one place.
RANKED_AT_ONCE = 200_000

# --- Estimation: the pose with the error of the map's walls -----------------------------------------------------------


# The walls' own error as assumed before any wall is observed, and how many walls that counts as. Fitted.
USUAL_WALL_ERROR = 0.02  # m
USUAL_WALLS = 2.0
UNSEEN_ERROR = 1.15  # fitted; variance of walls' errors over that of those which the gates let pass
LEAST_KNOWN_VARIANCE = 1e-12  # m^2, rounding; of walls whose error the caller knows
LEAST_WALL_ERROR = 0.003  # m, tables
ROUGH_FRACTION = 0.1  # of a wall's variance, tables; the part that differs along it
ESTIMATION_ROUNDS = 4  # tables; fewer where the step, m or rad, and the change of the walls' variance are small
SMALL_STEP, SMALL_CHANGE = 1e-4, 0.05  # tables
FREE_DEVIATION = 10.0  # m, geometry: what `SPRING` leaves
COMMON_WALL_ERROR = 0.04  # m, tables; what fixes a pose has to hold against that much

# --- Ranking ----------------------------------------------------------------------------------------------------------

SAME_FAMILY = 12.8  # squared deviations, geometry: 99.5 % of chi-square of three; two nearer poses are one

# --- Lines of sight ---------------------------------------------------------------------------------------------------

END_MARGIN = 0.06  # m, tables; rays keep this far from the ends of a segment, where neighbours meet
SIGHT_TOLERANCE = 0.2  # m, tables; a wall this near before the end of a ray does not block it
# Nats per metre of wall, tables; against a pose, where rays to the consensus set or to clutter pass through the wall.
BLOCKED = 2.0
BLOCKING_LENGTH = 3.0  # m, tables; beyond it a wall counts no more
BLOCKING_RAYS = 4.0  # that count fully, tables
FAR_BEHIND = 25.0  # nats, tables; a candidate so far behind needs no lines of sight

# --- Beams ------------------------------------------------------------------------------------------------------------

FIRST_RANKED = 64  # tables; poses that are looked at with
FEW_BEAMS = 60  # beams, tables: neighbouring beams say the same
BEAM_FINALISTS = 16  # tables
LATE_FINALISTS = 2  # measured; when the deadline has passed
BEAMS_READ = 100.0  # nats, tables; for a pose at which all beams read the wall they should
BEAMS_PASSED = 0.5 * BEAMS_READ  # nats, tables; against one at which all beams passed through a wall
NEAR = 0.1  # m, tables; deviation of a reading across the wall it should come from: noise, map and pose together
CERTAIN = 0.15  # m, tables; a reading farther across than this is not of that wall
LEAST_INCIDENCE = 0.15  # cosine, tables; nearer to grazing the pose decides too much
WALL_BEHIND = 30.0  # m, geometry; so far behind a reading a wall is looked for then
SURE_LENGTH = 3.0  # m, tables; shorter walls on a map made by a robot may have been people or carts

# --- Agreement: the view of the scan, compared with that of the map ---------------------------------------------------

AGREEING = 0.2  # m, tables; a beam and a wall nearer to each other than that, and
AGREEING_FRACTION = 0.02  # of the distance more, agree
MISSING_RANGE = 15.0  # m, tables; a wall nearer than that,
MISSING_LENGTH = 0.8  # m, tables; as long,
MISSING_SINE = 0.3  # tables; and not seen at a grazing angle, should be seen where nothing is
NEUTRAL = 0.8  # tables; where there is nothing to compare

# --- Acceptance: correspondences with the map's own segments ----------------------------------------------------------

MAX_OTHERS = 8  # map segments named in addition to the one that a scan segment lies on most
MOST_UNDER = 1000  # map segments under one scan segment that are compared; measured: in 443 maps a wall has up to 85
MIN_EXTENT = 1e-9  # m, rounding; least length that a segment along a wall counts as

CONTRADICTION = GAIN  # nats, tables; by which a pose that the prior speaks against must be better to contradict it
ONE_OF_MANY = 2.0  # m, tables; beyond it a fit along the weakest direction says less than the middle of the walls

# --- Estimation: unknowns beyond the pose, and their standard deviations before anything is seen ----------------------

OFFSET_DEVIATION = 0.05  # m, tables; of the walls along the rays: a bias of ranges, or the walls of a grid
STRAIN_DEVIATION = 0.004  # tables; of the map around the sensor, along x, y and across
SCALE_DEVIATION = 0.02  # tables; of its scale, which is the mean along x and y
TURN_DEVIATION = 1.0  # rad/s, tables; of the sensor during a scan, and
USUAL_SWEEP = 0.1  # s; how long that takes where it is not known
SHOWN_CHI_SQUARE = {3: 11.3, 4: 13.3, 5: 15.1}  # geometry: quantiles of 99 %, by the number of columns
