"""The records of the search alone; `association.layout` has those that stages share, and the units.

Lengths in metres, angles in radians, scores and gains in nats.
"""

from __future__ import annotations

import numpy as np

from ..layout import fields

_F, _I = np.float64, np.int64

# A base: two scan segments that fix a pose. The first has the second one to its left, or slides where the base is
# swept. Once it is weighed: how many crossings are listed of it, -1 where it is swept. Merit: the logarithm of the
# lesser gain, to a power, over the cost of searching the base; until it is weighed, over the least cost of any base.
BASE = fields((_I, "sliding crossing listed weighed"), (_F, "merit"))

# The terms of a scan segment in the cost of its bases: the number of direction bins in which it can slide; its angle;
# the factor on the number of hypotheses that follows from its length; the cost of sliding it everywhere.
LINE_COST = fields((_I, "bins"), (_F, "angle short sweep"))

# A list of crossings on which a base may lie: where it begins and ends; the column and row of its cell; the places of
# the first and second segment that decide the cell, from their midpoints, m; the greatest code that fits.
LISTED = fields((_I, "begin end column row"), (_F, "from_first from_second"), (_I, "code"))

# Segment a of a base laid on a wall chain, and the way of the midpoint of b through the grid while a slides: the chain;
# column and row of the present cell, and how these go on; the direction sectors that b may lie in, as bits; directions
# of the chain and of b; midpoint of b with a at abscissa 0 of the chain; the slides at which b enters the cell, and at
# which it stops; those at which it enters the next column and row, and what lies between two of them.
LAID = fields(
    (_I, "chain column row step_x step_y sectors"),
    (_F, "dx dy b_dx b_dy x y at high next_x next_y pace_x pace_y"),
)

# A cell that b sweeps, and that lists chains of its direction: which of the chains that a is laid on; the number of the
# cell in the grid; the slides between which b is in it.
SWEPT = fields((_I, "laid here"), (_F, "at until"))

# A chain of the direction of b on the list of a swept cell: its number; which of the swept cells. Or a crossing on a
# list: its entry. In the first ones of an array: which of them b lies on.
MET = fields((_I, "number cell hit"))

# Statistics of a search. Bases that were searched, hypotheses, those of them that were matched and refined; why it
# ended; probability of having missed a better consensus set; bound on the gain of a pose that contains none of the
# bases so far.
STATISTICS = fields((_I, "bases hypotheses verified why"), (_F, "missed bound"))

# Why a search ended: the deadline passed; all bases were searched; the bound shows that no better pose was missed; the
# probability of having missed one is small enough, or the best value is enough.
GOES_ON, INTERRUPTED, EXHAUSTED, PROVEN, CONFIDENT = range(5)

# A list of best poses: how many there are; the best value; the least value of a full list, else 0; the freedom that any
# set takes at least whose score would be stored.
BEST = fields((_I, "count"), (_F, "best_value least_value least_freedom"))


# Limits of a search: the greatest probability of having missed a better consensus set, -1 for all bases; a value
# that is known to be reached; metres between slides, and the fraction of the best value that parallel segments have to
# gain together to be slid; how many poses are stored.
LIMITS = fields((_F, "allowed known spacing slides_fraction"), (_I, "stored"))
