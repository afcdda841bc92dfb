"""Thresholds of the readers of logs."""

# Beams that angle_max may differ from angle_min + (n - 1) * angle_increment. Drivers set angle_max to n increments
# (LDS-01, neato: one beam more) or round it down by one; half a beam is left for rounding.
BEAMS_OFF = 1.5
