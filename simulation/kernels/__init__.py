"""Compiled ray casting; see `casting`."""
