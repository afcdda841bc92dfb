"""Every threshold of the verdict, with its unit and where it comes from; see `association.tuning` for the origins."""

import math

# --- Alternatives: compared in three ways -----------------------------------------------------------------------------

# Weights of the comparisons in the probability: as scored, by what the scan shows, with walls off by more.
COMPARISON_WEIGHTS = (0.8, 0.1, 0.1)  # cross-validated

# --- Alternatives: compared again with walls off by more --------------------------------------------------------------

# Explanations are scored again with gates as wide as walls may be off: by `LOOSE_WALLS` at least, and
LOOSE_FACTOR = 4.0  # tables; times as much as they seem to be: of many similar places the one that fits best shows less
LOOSE_BEAMS = 3.0  # tables; standard deviations of the walls within which a beam reads one then
LOOSE_TEMPERATURE = 1.5  # nats, tables; how far apart two places score that are as likely as one to e then
LOOSE_ALTERNATIVES = 8  # tables; the best and that many others

# --- Alternatives: compared again by what the scan shows --------------------------------------------------------------

# The most that each thing counts which an alternative has and the scan does not show, tables: it was moved away, with a
# probability of 1 in 8.
ABSENCE = 2.0  # nats
LEAST_OF_BEAM = 0.05  # nats, tables; a beam that speaks less against an alternative does not count

# --- Null score: that of the mirrored scan ----------------------------------------------------------------------------

SHORTEST_SHOWN = 0.2  # m, tables; less of a wall tells nothing of its symmetry
NULL_FRACTION = 0.7  # of the answer's score, tables; a null below it says no more
# By what fraction a null may be better than the answer, measured: of 11,275 right answers that are sure otherwise 3
# have one that is better by more. Else the laser is upside down, or the robot elsewhere.
MIRRORED_BETTER = 0.02
NULL_MARGIN = 0.9  # of the score in question, measured; a pose that scores less while it is searched for is not kept
NULL_ENOUGH = 1.1  # likewise; a null above it
# The probability that is allowed of having missed a better one. Tables: it is one feature among others;
NULL_ALLOWED = 0.01
NULL_ALLOWED_NEAR = 0.001  # where only what matters is looked for, which fewer bases show
NULL_SAMPLES = 1_024  # consensus sets, a resolution of 1e-3

# --- Verdict ----------------------------------------------------------------------------------------------------------

MANY = 8  # matched segments, tables; from which on the misfit says as much as it can
LONGEST_UNMATCHED = 4.0  # m, tables; a longer segment
MOST_UNMATCHED = 4.0 * LONGEST_UNMATCHED  # m, tables; and more clutter say no more
LIKE_WALLS = (0.8, 1.6)  # m, tables; scan lines of that length begin to count as walls, and count in full
MAX_LEAD = 40.0  # nats, tables
MOST_DEVIATION = 1.0  # m, tables
UNCOUNTED_FRACTION = 0.3  # of the best value, tables; worse alternatives do not count: the search finds them by chance
CROWD_TEMPERATURE = 4.0  # nats, tables
LEAST_CROWD = -12.0
MAX_GAP = 60.0  # nats, tables
MOST_NULL = 1.2  # tables; a null above it says no more
UNLIKE_SYMMETRY, SYMMETRIC = (
    0.7,
    0.95,
)  # tables; fractions between which a map comes to count as symmetric about a place
LEAST_MISFIT, MOST_MISFIT = 1e-2, 1e3
FITTED_ON_MAP = 0.5  # fraction of the scans of their map among those that the models were fitted to, about
# Fraction of the beams of a drive's exact views that read the walls, over that of all views. Of 2,823 right drives in
# drawn buildings and logs that were usable 1 in 500 came below 0.65; one whose frame was 3.8 degrees off to 0.36.
# Measured.
LEAST_IN_STEP = 0.55
FEW_WALLS = 3  # geometry: three sides of a room; fewer are never enough if one of them alone decides, and as many
OFFSET_OF_FEW = 0.002  # m, measured; only of segments, and where they are off by no more, root mean square
TOLERANCE = (0.3, math.radians(3.0))  # m, rad; a pose that is off by less is right
# The probability that is allowed of a pose beyond that, by its covariance. Measured: rejects 8 of 1,734 usable answers.
MOST_BEYOND = 0.05
# Fraction of a scan's length that is parallel to walls, 0.1 to 0.35 m from them. Measured: of 589 right answers on
# distorted maps, with turning robots and other errors 16 have more, 12 of these 4 deviations off and more; of 252 in
# logs 2.
MOST_DISPLACED = 0.25
FEWEST_FOR_TURN = MANY // 2  # lines; a rate and a heading are solved for
# Standard deviations from 0 of a turn during the scan. Measured: of the same answers 14 have more, all of turning
# robots and wrong angles between beams, and 4 deviations off and more; none in logs.
TURN_DEVIATIONS = 4.0
NO_ALTERNATIVE = 8.0  # nats, tables; an explanation that scores so much less is no alternative
TELLING_REASON = 1.0  # nats, tables; a reason that takes less of the odds is not returned
NO_MATCH_PROBABILITY = 0.03  # tables; of the first explanation or a similar place, other buildings included
ELSEWHERE_PROBABILITY = 0.1  # cross-validated; likewise, below it 3 % of scans of the map and most of others are
CONTRADICTED = 0.5  # the greatest probability of an answer then
FAR_FROM_PRIOR = -9.0  # nats; a pose of which a soft prior says less lies outside it, at 4.2 standard deviations
