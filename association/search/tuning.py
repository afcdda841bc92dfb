"""Thresholds of the search, with unit and origin."""

from __future__ import annotations

# --- Bases ------------------------------------------------------------------------------------------------------------
BASE_LINES = 40  # tables; bases are drawn among so many of the longest lines, and
TELLING_LINES = 96  # tables; of scans with more, those that are telling among so many
MIN_CROSSING_BASE = 0.3  # sine of the least angle between the lines of a base, tables
TELLING = 0.25  # m, tables; how far a base may lay the other lines off, root mean square
UNTELLING = 0.1  # tables; factor on the merit of a base that lays them farther off
REUSE = 0.3  # tables; factor on the merit of a base for each earlier use of one of its lines
DRAWN = 8  # bases at a time, measured; fewer calls, and a floor that rises later
GAIN_POWER = 3.0  # of the lesser gain, tables: long lines are clutter less often
# Cost of a base, of a chain that it may slide on, a metre of slide, and a hypothesis; nanoseconds, measured.
COST_BASE = 2000.0
COST_ANCHOR = 60.0
COST_SLIDE = 3.0
COST_HYPOTHESIS = 480.0
# Observed over expected number of hypotheses. Short walls stand next to long ones, at corners and doors: a base with a
# short line fits more often than lengths alone predict, and one across at a small angle less often. Measured.
HYPOTHESIS_SCALE = 2.0
SHORT_POWER = -0.7  # of the length of the shorter line, metres
SHORT_LENGTH = 0.1  # m
SINE_POWER = 0.3
# --- Hypotheses -------------------------------------------------------------------------------------------------------
POSED = 1024  # room for hypotheses of one call; it is left when half full, so that the floor rises between two calls
WINDOW_MARGIN = 0.5  # m, tables, and
WINDOW_TURN = 0.1  # rad, tables; a pose farther outside a hard prior's window is not refined into it
# --- Slides of parallel lines -----------------------------------------------------------------------------------------
SLIDE_LINES = 4  # tables; parallel walls alone are laid on every wall, by this many of the longest lines
SLIDE_SPACING = 2.0  # m, tables; the pose found stands for the family along the walls
SLIDE_SPACING_FOR_BEAMS = 0.5  # m, tables; beams then fix the position along them
SLIDE_DISTINCT = 0.9  # of the spacing, geometry; at which two of one family are distinct
PARALLEL_SINE = 0.1  # tables
# --- Stopping rule ----------------------------------------------------------------------------------------------------
SAMPLES = 10_240  # consensus sets, a resolution of 1e-4
SAMPLE_SEED = 20190901
# --- Best poses -------------------------------------------------------------------------------------------------------
KEPT = 64  # poses, tables
KEPT_FRACTION = 0.65  # of the best value, tables; poses below it are no alternatives
# If raw beams are to decide, the segments propose more. Tables.
KEPT_FOR_BEAMS = 192
KEPT_FRACTION_FOR_BEAMS = 0.65
PRUNED = 4  # times as many are held before the distinct ones are picked
