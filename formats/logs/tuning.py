"""Thresholds of reading logs, each with its unit and where it comes from."""

import math

MOVED = 0.05  # m and rad; a frame that stays within it does not move: half of what tracking allows at rest
MOST_GAP_NS = 500_000_000  # between two values of odometry that it is interpolated between, and around jumps of it
COMPARED_NS = 2_000_000_000  # over which the motions of two sources of odometry are compared
DIFFERENT = 0.25  # of the motion, by which these may differ in addition to JITTER: wheels slip, gyroscopes do not
MOST_PERIODS = 3  # the same, in periods of odometry: two messages that are lost
USUAL_GAP_NS = 200_000_000  # the same, at least: at 2 m/s^2 the middle is 1 cm off
PART_NS = 300_000_000  # a stamp that is so far before the last one begins a new part; messages out of order are nearer
CLOCKS_APART_NS = 500_000_000  # by which times from stamp to reception differ where clocks do; buffers delay by less
JITTER = 0.1  # m and rad that two values may differ at any times: stamps of one batch
STALE_NS = 500_000_000  # a moving transform holds no longer than this before its first and after its last value
FASTEST = 10.0  # m/s and rad/s; a robot indoors that seems to be faster has odometry that jumps
MOST_TILT = math.radians(20.0)  # of a scan plane; beyond, ranges say little of walls: cos(20 degrees) is 6 %
SAID_TILT = math.radians(2.0)  # of a scan plane, from which on it is reported: mounts are not more exact
UNIT = 0.1  # by how much the length of a quaternion may differ from 1: decimals that were cut off, not other numbers
REFIXED = 0.01  # m and rad; values of a fixed transform that differ by more are different mounts
SAMPLES = 500  # of a moving transform, at which it is looked whether it moves
