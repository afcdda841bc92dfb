"""Every threshold of the reader of grids, by stage; lengths in cells unless stated."""

# Which cells are what -------------------------------------------------------------------------------------------------

# Levels of the histogram of occupancy, 0 to 1.
LEVELS = 256

# A level of its own: this share of all cells at least, so many times its neighbours, and no darker than this occupancy;
# cells darker than the level of what is not known are this share of the free ones at least.
SPIKE_SHARE = 0.02
SPIKE_RATIO = 3.0
DARKEST_UNKNOWN = 0.8
DARKER_SHARE = 0.02

# Grey values, of 255, that tools write for unknown cells: map_saver 205; others 127, 128 and 200.
UNKNOWN_GREYS = (205, 200, 127, 128)

# Levels: how far a picture that was compressed may move such a grey value, and how far around it no level has as many
# cells. JPEG of quality 50 moves 205 to 206.
SHADE_REACH = 2
SPIKE_WINDOW = 8

# Levels: how far a compression spreads most cells of a grey value; and how many times as many cells as in the levels
# around that. JPEG of quality 50 to 90: 5 to 20 times; the gradients of willow and intel: 0.5 and 1.1 times.
NOISE_REACH = 3
NOISE_RATIO = 3

# Occupied cells for each free one, from which on a picture may be inverted. Most plans have a tenth; those whose
# unknown cells are black have one or two.
INVERTED = 3.0

# Cells: fewer of a level are no class of their own.
LEAST_CELLS = 10

# Cells between a free and an occupied one in a picture that was resized: how far either may lie.
EDGE_REACH = 3

# Share of the dark cells that the thresholds of the file must call occupied, and of the light cells that they must call
# free, for these to be used.
BELIEVED = 0.5

# Position of the wall -----------------------------------------------------------------------------------------------

# The wall's surface lies this share of the band of occupied cells behind its front, and in the first cell's middle at
# least. A value between two public grids that have a log: offsets of answers are least at 0.5 cells where the band has
# three (intel), and most scans are usable at 1.3 where it has four (freiburg-079).
BAND_SHARE = 1.0 / 3.0
LEAST_DEPTH = 0.5
GREATEST_BAND = 10

# Fraction of neighbouring bands whose thickness differs by at most a cell, from which on a grid is drawn, and the bands
# that this takes. Of mapped grids it is 0.82 to 0.87, of 24 plans drawn at 0 to 35 degrees 0.97 to 1 (0.85 to 0.92
# where both faces of walls were drawn with a gap of less than a cell). Up to twice `THIN` the thickness must not differ
# at all: that fraction is 0.48 to 0.59 and 0.96 to 1. Walls of one cell are the same in both kinds.
DRAWN = 0.92
LEAST_STEPS = 50
THIN = 1.0

# Standard deviation of a wall's surface, in cells. With the logs of intel and freiburg_079, 0.5 makes more scans usable
# than 0.7; without one the walls' error is estimated, which takes 2 to 50 times as long.
SURFACE_SIGMA = 0.5

# Lines ----------------------------------------------------------------------------------------------------------------

# Standard deviation of a contour's points about a straight wall: that of a staircase is 0.29. Of the scans of
# freiburg-079 and intel 81 and 75 % are usable with 0.25, 82 and 83 % with 0.3, 79 and 87 % with 0.35.
CONTOUR_SIGMA = 0.3

# Points on either side that determine the sharpness of a corner, if a contour has to begin at one.
CORNER_REACH = 3

# Least length of a segment, and points of a contour that are tried. Shorter pieces are what furnished rooms are
# told by: with 6 cells 44 % of the scans of freiburg-079 were usable, with 3 cells 61 %.
LEAST_LENGTH = 3.0
LEAST_POINTS = 4

# Occupied cells whose middle is farther than this from each line along the front of the cells are points of the map.
# Geometry: half a cell behind the line, and the steps of a line that is not along the grid.
COVERED = 1.5

# Borders of free cells for each cell, above which a grid of many borders is noise; each takes some 0.3 ms. Of public
# grids it is one in 250 to 950 cells, of noise one in 8 to 25.
MANY_CONTOURS, MOST_CONTOURS = 5_000, 1 / 60

# Points of a contour that are fitted together.
LONGEST_CONTOUR = 50_000

# Messages of ROS ------------------------------------------------------------------------------------------------------

# Least cosine between the z axes of a grid and of its frame: 2.6 degrees, far above the rounding of a quaternion.
UPRIGHT = 0.999

# Fraction of the cells around obstacles that have the cost of an inflated obstacle (99), from which on a grid is a
# costmap, and how many of them have to be known. By its definition a costmap gives 99 to each cell nearer to an
# obstacle than the robot's inscribed radius; slam_toolbox writes 0, 100 and -1 only. The value lies in the middle and
# is not measured.
INFLATED = 0.5
LETHAL_CELLS = 20
