"""Thresholds that several stages share, with unit and origin; the others stand in ``tuning.py`` of their stage.

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
NARROW_REACH = 0.15  # m, tables; a wall is in the raster of narrow gates where it is this near

# --- Scan: what a segment is worth and how far it is to be trusted ----------------------------------------------------

# What no sigma that is sent accounts for: maps drawn or built with some slack, walls that are not quite straight.
MODEL_OFFSET = 0.02  # m, tables; of a wall as a whole,
ROUGHNESS = 0.01  # m, tables; of which that much differs along it
MODEL_ANGLE = math.radians(0.6)  # tables
VIEW_ROUNDS = 6  # tables; of solving for a pose and the errors of its views
# What finding a segment on a wall is worth against its being clutter: a share of its own, and one by length.
GAIN = 6.0  # nats, tables
GAIN_PER_METRE = 2.0  # nats, tables
GAIN_LENGTH = 4.0  # m, tables; beyond it a segment tells no more

# --- Matching: when a scan segment lies on a wall ---------------------------------------------------------------------

GREATEST_ANGLE_GATE = 0.35  # rad, tables
# Between these lengths a segment comes to bridge a gap between walls: a short one may well be clutter there.
SHORT_BRIDGE, LONG_BRIDGE = 2.5, 3.5  # m, tables
FLAT_STEP = 0.03  # m, tables; between two walls on which a segment lies, up to where both count fully
FLAT_GATE = 0.9  # of a gate, tables; what lies farther off gains less, and nothing at the gate
OVERLAP_TAPER = 0.05  # beyond the least overlap, tables; up to there a match gains less, and nothing at the least
LEAST_COUNT = 1e-9  # rounding; of matches, to divide by
WHOLE_WORTH = 2.0  # nats, tables; a match that is worth less is a match in part
MOST_BRIDGED = 2000  # neighbours on their chains that the walls under one scan segment have, measured

# --- Consensus: growing and shrinking a set of matches at a pose ------------------------------------------------------

ROUNDS = 3  # tables; of matching and solving
MAX_STEP = 1.0  # m, tables; a consensus set that moves its pose farther than that, or
MAX_TURN = 0.2  # rad, tables; is not the one that the pose was proposed for
SAME_SHIFT = 1e-6  # m, rounding
SPRING = 1e-2  # 1/m^2; holds a pose along directions that no pair fixes, with 10 m of standard deviation
# How far a pose is free before anything fixes it: what a set is charged for fixing it more sharply. Tables.
FREE_DISTANCE = 0.3  # m
FREE_ANGLE = 0.1  # rad
START_VARIANCE = 1e-4  # m^2, tables; of a pose that comes without a covariance
START_ANGLE_VARIANCE = 1e-6  # rad^2, tables

# --- Proposing: bases, sweeps and slides ------------------------------------------------------------------------------

BASE_SLACK = 0.2  # m, tables; how far a scan segment of a base may stick out at an end of its wall
BASE_SLACK_SHARE = 0.1  # of its length, tables
MIN_CROSSING = 0.1  # sine of the least angle between the walls of a base, tables

# Bins of half a turn; an odd number, so that the middle one is about a right angle. Measured: with 23 it takes up to a
# tenth longer, with 91 as long.
CROSSING_ANGLES = 45

# --- Planning: the order of bases, and when enough have been gone through ---------------------------------------------

AT_ONCE = 256  # runs, cells and poses that go through a stage together; measured: with 64 it takes a tenth longer

# Work between two looks at the clock while poses are ranked: poses, times segments of the scan, times walls on the list
# of a place. More than all poses of a usual search, and some seconds where thousands of walls lie in one place.
RANKED_AT_ONCE = 200_000
# Work between two looks at the clock while poses are settled: pairs of scan lines. Some 20 ms; of fewer than 140 lines
# all poses that are returned.
SETTLED_AT_ONCE = 1_000_000
SORTED_BY_INSERTION = 64  # walls; of more an order by insertion takes longer than by merging
PAIRS_COMPARED = 250_000  # pairs of correspondences whose walls are compared at a time; 2 MB for each table

# --- Keeping: which poses are remembered ------------------------------------------------------------------------------

RIVAL_SHARE = 0.75  # of the best value, tables; a pose above it must not have been missed, for the verdict weighs it
DISTINCT_DISTANCE = 0.3  # m, tables
DISTINCT_ANGLE = 0.1  # rad, tables
SOFT_FLOOR = -20.0  # nats, tables; the most that a soft prior speaks against a pose
INSIDE = 1e6  # nats; puts every pose within a hard prior's window before those outside

# --- Settling: the answer worked out, with the error of the map's walls estimated -------------------------------------

# What the walls' own error is taken for before any is seen, and how many walls that counts as. Fitted.
USUAL_WALL_ERROR = 0.02  # m
USUAL_WALLS = 2.0
UNSEEN_ERROR = 1.15  # fitted; variance of walls' errors over that of those which the gates let pass
LEAST_KNOWN_VARIANCE = 1e-12  # m^2, rounding; of walls whose error the caller knows
LEAST_WALL_ERROR = 0.003  # m, tables
ROUGH_SHARE = 0.1  # of a wall's variance, tables; what differs along it
SETTLING_ROUNDS = 4  # tables
FREE_DEVIATION = 10.0  # m, geometry: what `SPRING` leaves
# Explanations are scored again with gates as wide as walls may be off: by so much at least,
LOOSE_WALLS = 0.05  # m, tables
LOOSE_FACTOR = 2.0  # tables; and times as much as they seem to be,
LOOSE_BEAMS = 0.5  # tables; and with that share of what beams say, which read centimetres
LOOSE_RIVALS = 8  # tables; the best and that many others
COMMON_WALL_ERROR = 0.04  # m, tables; what fixes a pose has to hold against that much

# --- Scan and map that differ by a factor -----------------------------------------------------------------------------

LEAST_OFF_WALLS = 0.01  # m, tables; walls that are off by less, as estimated, leave nothing to a factor
LEAST_FACTOR, MOST_FACTOR = 0.004, 0.04  # tables; a factor is tried that is so far from one,
FACTOR_DEVIATIONS = 1.5  # tables; and by so many of its standard deviations
FACTOR_ROUNDS = 3  # tables
FACTOR_GAP = 6.0  # nats, tables; it is taken where the answer scores so much more,
FACTOR_WALLS = 2.0  # tables; and so many walls agree beyond those that it takes
# A greater factor puts the answer in doubt, if so many walls agree beyond those that it takes, or it is beyond noise.
DOUBTING_WALLS = 1.0  # tables
DOUBTING_DEVIATIONS = 3.0  # geometry
RIVAL_SCALES = (1.0, 0.94, 0.96, 0.98, 1.02, 1.04, 1.06)  # tables; at which rivals are looked for, where one is taken
RIVAL_FACTOR = 0.08  # tables; what rivals may be off by in the end
LEAST_AS_SENT = 0.5  # of the answer's score, tables; what comes to less there is no rival at a scale of its own
SAME_PLACE = 1.0  # m, geometry; what a factor may move a pose

# --- Ranking ----------------------------------------------------------------------------------------------------------

LEAST_DISTINCT = 24  # tables; explanations told apart at least: the verdict weighs the best against the others
SAME_FAMILY = 12.8  # squared deviations, geometry: 99.5 % of chi-square of three; two nearer poses are one

# --- Lines of sight ---------------------------------------------------------------------------------------------------

RAY_SPACING = 0.25  # m, tables; between the points of a segment that rays are sent to
MAX_RAYS = 12  # to one segment, tables
END_MARGIN = 0.06  # m, tables; rays keep this far from the ends of a segment, where neighbours meet
SIGHT_TOLERANCE = 0.2  # m, tables; a wall this near before the end of a ray does not block it
BLOCKED = 2.0  # nats a metre of wall, tables; against a pose, where rays to the consensus set pass through the wall
BLOCKED_CLUTTER = 2.0  # nats a metre, tables; likewise for rays to clutter
BLOCKING_LENGTH = 3.0  # m, tables; beyond it a wall speaks no more
BLOCKING_RAYS = 4.0  # that count fully, tables
# Walls that are looked at for rays between two looks at the clock, at most: a third of a second. Where one pose takes
# more no ray is followed, and the search is not complete. Measured: scans in their maps take up to 3 million.
MOST_LOOKED_AT = 200_000_000
EMPTY_CELL = 4  # walls, measured; what it takes to go to the next cell
FAR_BEHIND = 25.0  # nats, tables; a candidate so far behind needs no lines of sight

# --- Null: what the mirrored scan scores ------------------------------------------------------------------------------

SHORTEST_SHOWN = 0.2  # m, tables; less of a wall tells nothing of its symmetry
NULL_KEPT = 24  # poses, tables
NULL_SHARE = 0.7  # of the answer's score, tables; a null below it says no more
# By what share a null may be better than the answer, measured: of 11,275 right answers that are sure otherwise 3 have
# one that is better by more. Else the laser is upside down, or the robot elsewhere.
MIRRORED_BETTER = 0.02
# Shares at which it is looked up whether a null matters; beyond the last it always does.
NULL_SHARES = (0.75, 0.8, 0.85, 0.9, 0.95, 1.0, 1.0 + MIRRORED_BETTER)
NULL_MARGIN = 0.9  # of the score in question, measured; a pose that scores less while it is searched for is not kept
NULL_ENOUGH = 1.1  # likewise; a null above it
# The chance that is allowed of having missed a better one. Tables: it is one feature among others;
NULL_ALLOWED = 0.01
NULL_ALLOWED_NEAR = 0.001  # where only what matters is looked for, which fewer bases show
NULL_SAMPLES = 1_024  # consensus sets, a resolution of 1e-3

# --- Beams ------------------------------------------------------------------------------------------------------------

FEW_BEAMS = 60  # tables; for a first look: neighbouring beams say the same
MOST_BEAMS = 180  # tables
BEAM_FINALISTS = 32  # tables
# When the deadline has passed so many candidates are looked at, and of them so many finalists. Measured.
LATE_CANDIDATES = 16
LATE_FINALISTS = 2
LATE_CROWD = 500.0  # measured; walls on the list that a place on a wall has, from which rays are left out then
BEAMS_READ = 100.0  # nats, tables; for a pose at which all beams read the wall they should
BEAMS_PASSED = 50.0  # nats, tables; against one at which all beams passed through a wall
NEAR = 0.1  # m, tables; deviation of a reading across the wall it should come from: noise, map and pose together
CERTAIN = 0.15  # m, tables; a reading farther across than this is not of that wall
BEHIND = 2.0  # m, tables; how far behind a reading a wall is looked for
LEAST_INCIDENCE = 0.15  # cosine, tables; nearer to grazing the pose decides too much
LEAST_POINTS = 10  # tables; for the beams to move a pose
BEAM_GATES = (0.35, 0.25, 0.15, 0.15)  # m, tables; of the rounds in which they do
PASSED_SLACK = 0.01  # tables; share of beams that may pass more where a pose was moved
FARTHER_BY = 0.05  # m, tables; across the wall that the map shows; a beam that reads farther by more, or
NEARER_BY = 0.1  # m, tables; nearer, does not read it
WALL_BEHIND = 30.0  # m, geometry; so far behind a reading a wall is looked for then
COMPARED_BEAMS = 720  # measured; that many are looked at
SURE_LENGTH = 3.0  # m, tables; shorter walls on a map made by a robot may have been people or carts

# --- Agreement: what is seen beside what the map shows ----------------------------------------------------------------

RAYS = 120  # tables
AGREEING = 0.2  # m, tables; a scan segment and a wall nearer to each other than that, and
AGREEING_SHARE = 0.02  # of the distance more, agree
FAR = 25.0  # m, tables; farther walls are looked for only as far as one and a half times the scan reaches
FARTHER = 1.5
MISSING_RANGE = 15.0  # m, tables; a wall nearer than that, within the reach of the scan,
MISSING_LENGTH = 0.8  # m, tables; as long,
MISSING_SINE = 0.3  # tables; and not seen at a grazing angle, should have left a segment
BLIND_SHARE = 0.25  # of the circle, tables; a wider gap without any segment is out of the sensor's view
NEUTRAL = 0.8  # tables; where there is nothing to compare

# --- Chance -----------------------------------------------------------------------------------------------------------

LEAST_CHANCE, MOST_CHANCE = 1e-6, 0.9  # of one match, rounding
LEAST_SIGNIFICANCE = 1e-300  # rounding

# --- Reporting --------------------------------------------------------------------------------------------------------

HINGES = 0.1  # m, geometry: the finest pose that a robot docks by; a pose that moves less does not hinge on one wall
FACING = 0.05  # m, geometry; a wall seen along itself may pass the sensor on either side
# Of the ranges that came back at least that many, and that share, at one value to the digit. In the logs, which give
# centimetres, it is 18 % at most.
LEAST_STUCK = 10
STUCK_SHARE = 0.5  # measured
EXCEEDING = 1.1  # of the map's diagonal, measured; the scans of plans and logs in their own maps come to 1.0
MAX_RIVALS = 8  # map segments named beside the one that a scan segment lies on most
MOST_UNDER = 1000  # map segments under one scan segment that are compared; measured: in 443 maps a wall has up to 85
MIN_EXTENT = 1e-9  # m, rounding; what a segment along a wall counts as at least

# --- Causes: a caller's mistakes --------------------------------------------------------------------------------------

TIMES_FOR_CAUSES = 2.0  # of the answer's own time; the contract
LEAST_TIME_FOR_CAUSES = 0.02  # s, measured; where nothing fits an answer takes no time, and twice that is none
CAUSE_CONFIDENCE = 0.99  # tables
CAUSE_KEPT = 24  # poses, tables
# Where a changed scan would not be usable either, it still fits much better with so much more score and share.
# Measured: of 127 scans in their map that were not usable none did so.
CAUSE_GAP = 30.0  # nats
CAUSE_RATIO = 1.5
CAUSE_SHARE = 0.7  # of the length
USUAL_EXTENT = 12.0  # m, tables; of a scan
GREATEST_EXTENT = 60.0  # m, tables; a larger scan is of another unit itself
# Times; a scan that is scaled by more falls out of the gates of the search, which are metres: then the map is scaled.
GREATEST_SAME_GATES = 5.0
USUAL_PART = (0.25, 2.0)  # times, tables; usual length of scan lines, once of one unit, over that of walls
MOST_FOR_UNITS = 2000  # map segments; indexing them anew takes some 20 ms
LEAST_STRETCH, GREATEST_STRETCH = 0.004, 0.12  # tables; how far a factor near one may be from it
SCALE_LENGTH = 0.5  # of the scan's length, tables; that has to match where the gates are wide
SCALE_KEPT = 8  # poses, tables
SCALE_SHARE = 0.75  # of the best value, tables
SCALE_FITS = 3  # tables
SCALE_OUTLIER = 3.0  # times the median, tables

# --- Verdict ----------------------------------------------------------------------------------------------------------

MANY = 8  # matched segments, tables; from which on the misfit says as much as it can
NEARLY_ALL = 0.85  # of the scan's length, tables
LONGEST_UNMATCHED = 4.0  # m, tables; a longer segment
MOST_UNMATCHED = 16.0  # m, tables; and more clutter say no more
MAX_LEAD = 40.0  # nats, tables
MOST_DEVIATION = 1.0  # m, tables
UNCOUNTED_SHARE = 0.3  # of the best value, tables; rivals below are no crowd: what the search finds of them is chance
CROWD_TEMPERATURE = 4.0  # nats, tables
LEAST_CROWD = -12.0
MAX_GAP = 60.0  # nats, tables
LEAST_CHANCE_FEATURE = -30.0  # log10, tables; less likely chance says no more
MOST_NULL = 1.2  # tables; a null above it says no more
UNLIKE_SYMMETRY, SYMMETRIC = 0.7, 0.95  # tables; between which a map comes to count as symmetric about a place
LEAST_MISFIT, MOST_MISFIT = 1e-2, 1e3
TWIN_TEMPERATURE = 1.5  # nats, fitted; how far apart two explanations score that are as likely as one to e
USABLE_PROBABILITY = 0.94  # cross-validated
USABLE_CAUTIOUS = 0.9  # cross-validated; of the same, where other buildings are reckoned with,
USABLE_CAUTIOUS_WITH_BEAMS = 0.9  # cross-validated; and where raw beams speak too
# The same of views that are not exact: the models were fitted to scans from one place. Of drives of 5 m through sister
# buildings, and of 10 m in logs, those that were usable and wrong came to 0.92 and 0.945. Measured.
USABLE_CAUTIOUS_DRIVE = 0.95
# What the exact views of a drive read of the walls over what all do. Of 2,823 right drives in drawn buildings and logs
# that were usable 1 in 500 came below 0.65; one whose frame was 3.8 degrees off to 0.36. Measured.
LEAST_IN_STEP = 0.55
# The answer of the last view of a drive alone stands for the drive where the best pose of the drive is so near, and the
# cautious probability of the drive is as high. Measured on 764 drives of 10 m in drawn buildings, as ranges and as
# segments: of 47 right answers that only the last view makes usable one is below 0.5, of 14 in other buildings five.
AGREED_DISTANCE = 0.3  # m
AGREED_ANGLE = math.radians(3.4)
AGREED_CAUTIOUS = 0.5
FEW_WALLS = 3  # geometry: three sides of a room; fewer are never enough if one of them alone decides, and as many
OFFSET_OF_FEW = 0.002  # m, measured; only of segments, and where they are off by no more, root mean square
NO_TWIN = 8.0  # nats, tables; an explanation that is so much less worth is no twin
TELLING_REASON = 1.0  # nats, tables; a reason that takes less of the odds is not told
NO_MATCH_PROBABILITY = 0.03  # tables; of the first explanation or a twin of it, other buildings reckoned with
ELSEWHERE_PROBABILITY = 0.1  # cross-validated; likewise, below it 3 % of scans of the map and most of others are
CONTRADICTION = 6.0  # nats, tables; by which a pose that the prior speaks against must be better to contradict it
CONTRADICTED = 0.5  # the most that an answer can then be probable
FAR_FROM_PRIOR = -9.0  # nats; a pose of which a soft prior says less lies outside it, at 4.2 standard deviations
ONE_OF_MANY = 2.0  # m, tables; beyond it a fit along the weakest direction says less than the middle of the walls
