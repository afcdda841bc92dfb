"""Thresholds of the map index, with unit and origin.

Origins: *geometry* follows from what the number means; *tables* was chosen by the tables of `docs/dev/search.md` on
floor plans and logs, and little changes near it; *measured* is a fit or a timing; *rounding* keeps arithmetic sound.
"""

import math

# --- Walls ------------------------------------------------------------------------------------------------------------

MAX_EXTENT = 1e5  # m; the contract
MAX_MAP_SIGMA = 10.0  # m; the contract
# Pieces that are one line to rounding are one wall; a declared deviation of the map makes that narrower.
ONE_LINE = 1e-4  # m, rounding
LEAST_DIFFERENCE = 1e-6  # m, rounding; walls whose offsets or lengths differ by less are equal in them
ONE_LINE_SHARE = 0.1  # of the map's deviation, geometry
# Walls that continue one another with a small step are put on a common line: the larger the step, the less, and from
# here on not at all.
BLENDED_STEP = 0.045  # m, tables; of a map without a declared deviation
BLENDED_SIGMAS = 4.0  # geometry; otherwise, up to the same
BLENDED_WALLS = 16  # on either side, measured
LINK_GAP = 3.0  # m, tables; of walls that a scan segment may lie on over the gap between them
TIE_FREE = 30.0  # minus the log of a correlation that is none
TIES_BEFORE = 6  # walls before it that one is tied to at most, measured

# --- Wall chains: lines through walls that nearly continue one another, also across doorways --------------------------

MERGE_GAP = 0.3  # m, geometry: a doorway is wider, the joint between two pieces of one wall is not
CHAIN_GAP = 1.5  # m, geometry: a base segment may bridge a doorway
MERGE_LATERAL = 0.03  # m, tables
MERGE_ANGLE = math.radians(2.0)  # tables

# --- Search for pieces that continue one another ----------------------------------------------------------------------

BEGIN_CELL = 1.0  # m, by which begins of pieces are found, at least; measured: little changes near it
MOST_STEPS = 100  # places along one piece around which others are looked for; geometry: 190 m of wall
MOST_LOOKS = 600  # begins that one piece is compared with; measured: no fewer walls are found on 443 maps of buildings
PIECES_A_LOOK = 4_000  # pieces that are compared between two looks at a deadline: 0.2 s where each takes the most

# --- Grids ------------------------------------------------------------------------------------------------------------

CELL = 1.0  # m, tables
SWEEP_CELL = 2.0  # m, tables; of the sweep's grid
SWEEP_REACH = 0.02  # m, rounding
RASTER_CELL = 0.5  # m, tables; also of the grid of walls and points
NEIGHBOURHOOD = 64.0  # m, squares of which the chains are numbered together; measured: 8 to 128 are as good
MAX_CELLS = 4_000_000  # memory: some 50 MB
MAX_SWEEP_CELLS = 1_000_000  # memory
MAX_ENTRIES = 10_000_000  # memory; of all lists of a grid together, about
CELL_GROWTH = 1.25  # by which cells grow until their lists fit
