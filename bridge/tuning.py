"""Limits and thresholds of the package, with unit and origin."""

from __future__ import annotations

import math

# What is read of messages from outside. More is refused, never cut.
MAX_BEAMS = 100_000  # of a scan; geometry: a beam each 0.0036 degrees
MAX_TRANSFORMS = 2_000  # of one message; a humanoid robot has some 200
MAX_FRAMES = 5_000  # that are stored, some 2 KB each
TRANSFORMS_KEPT = 200  # of a moving frame: 2 s at 100 Hz
MAX_COORDINATE = 1e8  # m; the radius of the Earth is 6.4e6 m
MAX_MOUNT = 100.0  # m from the base to a laser; the longest vehicles with lasers have some 60 m
MAX_GRID_BYTES = 64 * 2**20  # of an OccupancyGrid: 64 million cells
MAX_SPEED = 100.0  # m/s
MAX_TURN_RATE = 100.0  # rad/s
QUATERNION_TOLERANCE = 0.1  # of the length; tf2 refuses what is farther from 1 than 0.01
MAX_TILT = math.radians(20.0)  # of a scan plane; ranges to walls are 6 % too long there
LEVEL_TILT = math.radians(2.0)  # below this, ranges are less than 0.1 % too long
STALE_NS = 500_000_000  # ns; a moving transform is not used this long after its last value
CLOCK_BACK_NS = 1_000_000_000  # ns; stamps that jump back by more are those of a clock that was set back

# What takes time.
CONVERSION_SECONDS = 60.0  # s of a core for a grid: the slowest public plan takes 4 s, noise some minutes
CONVERSION_PATIENCE = 300.0  # s, where others are at work on the cores
CONVERSION_BYTES = 4 * 2**30  # address space of the process that converts a grid
SEARCH_SECONDS = 10.0  # s for one scan; the slowest of the public logs takes 1 s
END_SECONDS = 0.5  # s that the end waits for a search
REPEAT_SECONDS = 1.0  # s within which the same problem is published once
