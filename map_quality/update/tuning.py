"""Thresholds of map updates; `drawn` means chosen on buildings that `simulation` draws."""

from __future__ import annotations

import math

# --- Scans that give evidence -----------------------------------------------------------------------------------------

MOST_SIGMA, MOST_TURN_SIGMA = 0.05, math.radians(1.0)  # m, rad; deviations of a pose that is known well enough
MOST_OWN_SIGMA = 1.0  # m; deviation of an own or carried pose that may confirm that of the search; drawn
AGREEING = 11.3  # chi-square of 3 degrees of freedom, 99 %; of both poses
ODOMETRY, ODOMETRY_A_METRE = 0.1, 0.1  # m, and for each metre; deviations of odometry, as `linefix replay` has them
ODOMETRY_TURN, ODOMETRY_TURN_A_METRE, ODOMETRY_TURN_A_RADIAN = 0.05, 0.02, 0.1  # rad, for each metre, for each radian
MOST_CONFIRMING_SIGMA = 2.0  # m; deviation of odometry by which one usable scan may confirm another
LEAST_USABLE = 0.2  # fraction of a visit's scans; other drawn buildings 0, a public log that is half off the map 0.29
LEAST_SCANS = 3  # usable ones of a visit
OFF_SCALE, SURE_OF_SCALE = 0.005, 0.0025  # fractions, drawn; lengths of a visit are off by, and known to
HELD_BACK = 10  # one scan in so many gives no evidence, and tests the new map
NEXT_HELD_BACK = 7  # by so many later in the next visit: a robot may pass the same places in the same order
MOST_BEAMS = 720  # of a scan, time
MOST_CELLS = 400_000  # pairs of a table that is in memory at once
USUAL_SIGMA = 0.02  # m; of the walls of a map that does not declare it

# --- Evidence of beams ------------------------------------------------------------------------------------------------

CHUNK = 0.2  # m; walls are judged in pieces of about this length
LEAST_SLANT = 0.17  # sine of the angle between beam and wall; flatter beams are no evidence
MOST_PASSED = 32  # walls that one beam is evidence of, the nearest; memory
LEAST_TOLERANCE = 0.06  # m; a beam that ends no farther from a wall reads it
DEVIATIONS = 3.0  # times the standard deviation, likewise
THROUGH = 2.0  # times the tolerance; a beam that ends farther behind a wall passed through it
PLACE = 0.5  # m; scans from the same square of this side count as one pose

# --- Decisions about a chunk ------------------------------------------------------------------------------------------

LEAST_BEAMS = 3  # of a visit
FEW, MOST = 0.1, 0.7  # fractions of a visit's beams: those that contradict it, those that agree
LEAST_VISITS, LEAST_POSES = 2, 3
ENOUGH_VISITS = 3  # that agree, where they have seen it from fewer poses

# --- Changes ----------------------------------------------------------------------------------------------------------

LEAST_GONE = 0.6  # fraction of a wall's length that is gone, if nothing reads the rest: the wall is removed
THING = 30.0  # m; longest outline of a thing: a closed loop of walls
LOOP_GAP = 0.01  # m; corners that are nearer are one
LEAST_GONE_OF_THING = 0.3  # fraction of its outline that beams pass through, drawn
FEW_ON_THING = 0.03  # fraction of the beams, drawn
LEAST_CUT = 0.5  # m; a wall is shortened by no less
LEAST_PIECE = 0.2  # m; that is added
LONGEST_STUB = 0.32  # m; below it nothing remains of a wall; as accurate as its end is known
LEAST_SEEN = 0.25  # m; shorter lines of a scan do not suggest a wall
SAME_ANGLE = math.radians(4.0)  # between lines of scans that show one wall
SAME_LINE = 0.08  # m, likewise
SAME_GAP = 0.3  # m; along the wall
BIN = 0.05  # m; resolution of the ends of a new wall
ON_MAP = 0.12  # m; nearer to a wall of the map, and parallel, nothing is added
DOUBLED = 0.25  # m; across, between new walls that face the same way; public logs: flat beams are 0.2 m off
SAME_SIDE = 0.5  # cosine between walls that face about the same way
FULLY_ON_MAP = 0.85  # fraction of a scan line's length
LONGEST_LEAF = 1.5  # m; of a door, and its width where it is a double door
JAMB = 0.25  # m; between a leaf and the end of a wall that it is fixed to, or shuts against
DOOR_VISITS = 4  # that show a wall which may be a leaf; on fewer a door may happen to stand alike
JOINED = 0.2  # m; ends of walls that are one thing
SIDES = 4  # geometry; of a thing, which may turn when it is moved
NEAR_MOVE = 3.0  # m; between the middles of a thing before and after it was moved
SAME_LENGTH, SAME_FRACTION = 0.15, 0.05  # m, and fraction; by which a side of a moved thing may differ

# --- Sharper walls ----------------------------------------------------------------------------------------------------

LEAST_BLUR = 0.008  # m; of a map's declared sigma below which its walls stay as they are
SHARPER = 0.7  # times the declared sigma; the deviation of a wall above which it stays as it is
ANGLE_FLOOR = 0.0005  # rad; errors of the lines of one scan that do not average out
MOST_POSES = 1000  # of scans that are estimated with the walls; memory and time
MOST_TILT = 0.05  # rad; deviation of a wall's direction, however short it is
FREE_POSE = (1.0, 1.0, 0.5)  # m, m, rad; deviations of a pose of which nothing is known

# --- Confidence, and the check of the proposal ------------------------------------------------------------------------

DOUBT_VISIT, DOUBT_POSE = 0.1, 0.7  # probability that a visit, or a pose, shows a change that is none; drawn
MOST_CONFIDENCE = 0.9999
LOWER_SCORE = 1.0  # nats; a change may lower the score of its scans by no more
SAME_POSE = 0.3  # m; between the poses of one scan on the old and the new map
FEWER_USABLE = 0.01  # fraction of the scans; a proposal that loses more is withdrawn
