"""Thresholds of the search, with unit and origin.

Origins: *geometry* follows from what the number means; *tables* was chosen by the tables of `docs/dev/search.md` on
floor plans and logs, and little changes near it; *measured* is a fit or a timing; *rounding* keeps arithmetic sound.
"""

from ..tuning import DISTINCT_ANGLE

# --- Bases ------------------------------------------------------------------------------------------------------------

BASE_SEGMENTS = 40  # tables; bases are drawn among this many of the longest segments; and, in scans of more,
# the informative ones among as many of these as there are: else the possible gain of all others keeps a search going.
TELLING_SEGMENTS = (48, 56, 64, 72, 80, 88, 96)  # tables
MIN_CROSSING_BASE = 0.3  # sine of the least angle between the scan segments of a base, tables

# --- Hypotheses -------------------------------------------------------------------------------------------------------

CROSSING_MARGIN = 1e-3  # m, rounding; of the lists of crossings
MOST_LISTS = 256  # for one base; it is swept where there are more. Measured: at most one base in a thousand
WHOLE_OVERLAP = 0.5  # geometry; least overlap from which a midpoint is on a wall, or between two
WINDOW_MARGIN = 0.5  # m, tables, and
WINDOW_TURN = DISTINCT_ANGLE  # rad, tables; a pose farther outside a hard prior's window is not refined into it

# --- Slides of parallel segments --------------------------------------------------------------------------------------

SLIDE_SEGMENTS = 4  # tables; parallel walls alone are laid on every wall, by this many of the longest segments
SLIDE_SPACING = 2.0  # m, tables; the pose found stands for the family along the walls
SLIDE_SPACING_FOR_BEAMS = 0.25 * SLIDE_SPACING  # m, tables; beams then fix the position along them
SLIDE_DISTINCT_SHARE = 0.9  # of the spacing, geometry; at which two of one family are distinct
PARALLEL_SINE = 0.1  # tables

# --- Order of the bases -----------------------------------------------------------------------------------------------

TELLING = 0.25  # m, tables; how far a base may lay the other segments off, root mean square
UNTELLING = 0.1  # tables; factor on the merit of a base that lays them farther off
TIMES_BETTER = 2.0  # tables; a base is weighed where its merit may be so many times that of another
REUSE = 0.3  # tables; factor on the merit of a base for each earlier use of one of its segments
# Cost of a base, an entry of its lists with its hypotheses, a chain that it may slide on, a metre of slide, and a
# hypothesis; nanoseconds, measured.
COST_BASE = 2000.0
COST_ENTRY = 50.0
COST_ANCHOR = 60.0
COST_SLIDE = 3.0
COST_HYPOTHESIS = 480.0
# Observed over expected number of hypotheses. Short walls stand next to long ones, at corners and doors: a base with a
# short segment fits more often than lengths alone predict, and one across at a small angle less often. Measured.
HYPOTHESIS_SCALE = 2.0
SHORT_POWER = -0.7  # of the length of the shorter segment, metres
SHORT_LENGTH = 0.1  # m
SINE_POWER = 0.3
GAIN_POWER = 3.0  # of the lesser gain, tables: long segments are clutter less often

# --- Stopping rule ----------------------------------------------------------------------------------------------------

SAMPLES = 10_240  # consensus sets, a resolution of 1e-4
SAMPLE_SEED = 20190901

# --- Best poses -------------------------------------------------------------------------------------------------------

KEPT = 64  # poses, tables
KEPT_SLIDES = KEPT  # poses, tables
KEPT_SHARE = 0.65  # of the best value, tables; poses below it are no alternatives
# If raw beams are to decide, the segments propose more. Tables.
KEPT_FOR_BEAMS = 192
KEPT_SHARE_FOR_BEAMS = 0.5
