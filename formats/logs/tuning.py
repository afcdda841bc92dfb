"""Thresholds of reading logs, each with its unit and where it comes from."""

import math

MOVED = 0.05  # m and rad; a frame that stays within it does not move: half of what tracking allows at rest
STALE_NS = 500_000_000  # a moving transform holds no longer than this before its first and after its last value
WINDOW_NS = 500_000_000  # between the values that a speed is taken from, the duration of the scan aside
FASTEST = 10.0  # m/s and rad/s; a robot indoors that seems to be faster has odometry that jumps
MOST_TILT = math.radians(20.0)  # of a scan plane; beyond, ranges say little of walls: cos(20 degrees) is 6 %
SAID_TILT = math.radians(2.0)  # of a scan plane, from which on it is reported: mounts are not more exact
UNIT = 0.1  # by how much the length of a quaternion may differ from 1: decimals that were cut off, not other numbers
REFIXED = 0.01  # m and rad; values of a fixed transform that differ by more are different mounts
SAMPLES = 500  # of a moving transform, at which it is looked whether it moves
