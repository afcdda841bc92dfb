"""Limits of the numbers that the packages accept."""

MAX_COORDINATE = 1e9  # m; beyond it float64 resolves less than a micrometre
MIN_LENGTH = 1e-6  # m; shorter segments have no reliable direction
MAX_LENGTH = 1e4  # m, of a segment, and of a range
MAX_SIGMA = 1e3  # m
MAX_ANGLE = 1e3  # rad
MAX_POINTS = 1e9  # behind a segment
MAX_BEAMS = 100_000  # of a scan, or points
