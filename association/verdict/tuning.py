"""Every threshold of the verdict, with its unit and where it comes from; see `association.tuning` for the origins."""

from __future__ import annotations

# --- Alternatives: compared by things, with walls off by more ---------------------------------------------------------

COMPARED = 12  # alternatives, tables
# Explanations are refined again with gates as wide as walls may be off: by `LOOSE_WALLS` at least, and
LOOSE_FACTOR = 4.0  # tables; times as much as they seem to be: of many similar places the one that fits best shows less
LOOSE_BEAMS = 3.0  # tables; times as much for single beams
# The most that each thing counts, for the answer or against it: it was moved. Alone, it leaves a probability of 0.94.
OF_A_THING = 2.75  # nats
THING_WIDTH = 2.0  # m, tables; of doors, niches, cupboards, closed openings; wider things count as several
THINGS_APART = 1.2  # m, tables; what differs at places that are nearer is one thing
LEAST_OF_BEAM = 0.05  # nats, tables; a beam that speaks less against an alternative does not count
UNCOUNTED, COUNTED = 0.3, 0.75  # of the best value, tables; worse alternatives are found by chance, and do not count

# --- Null score: that of the mirrored scan ----------------------------------------------------------------------------

NULL_FRACTION = 0.7  # of the answer's score, tables; a null below it says no more
NULL_ENOUGH = 1.1  # likewise; a null above it
MOST_NULL = 1.2  # tables; likewise
NULL_ALLOWED = 0.01  # tables; probability of having missed a better one: it is one feature among others

# --- Features ---------------------------------------------------------------------------------------------------------

MAX_GAP = 60.0  # nats, tables
CROWD_TEMPERATURE = 4.0  # nats, tables
LEAST_THING = 0.3  # m; shorter scan lines are not counted as things.
# Counted as seen, and as moved, before the first line. Measured: of strong differences to another pose, 2 % speak
# against the truth where all lines are matched, 14 % with 1 to 3 unmatched lines, 25 % with 4 to 6, 36 % with more.
SEEN_BEFORE, MOVED_BEFORE = 8.0, 0.5  # tables
LEAST_MISFIT, MOST_MISFIT = 1e-2, 1e3
MOST_DEVIATION = 1.0  # m, tables
LIKE_WALLS = (0.8, 1.6)  # m, tables; scan lines of that length begin to count as walls, and count in full
MOST_UNMATCHED = 16.0  # m, tables; more clutter says no more

# --- Verdict ----------------------------------------------------------------------------------------------------------

# Of the first explanation or a similar place, at even odds of being elsewhere; tables. More than half of the held-out
# scans from other kinds of buildings are below it, and 1 in 170 of the right answers, none of which is usable.
NO_MATCH_PROBABILITY = 0.11
CONTRADICTED = 0.5  # the greatest probability of an answer then
FAR_FROM_PRIOR = -9.0  # nats; a pose of which a soft prior says less lies outside it, at 4.2 standard deviations
NO_ALTERNATIVE = 0.99  # tables; an answer that is so probable among its alternatives has none
TELLING_REASON = 1.0  # nats, tables; a reason that takes less of the odds is not returned
