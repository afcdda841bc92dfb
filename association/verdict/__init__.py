"""Estimate how likely the best pose is right, and decide whether a robot may use it."""
