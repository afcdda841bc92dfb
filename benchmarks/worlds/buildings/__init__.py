"""Families of buildings to scan: each draws styles, and each style draws buildings that are sisters."""

from .families import FAMILIES, Family, Style
from .plan import FIXED, Building

__all__ = ["FAMILIES", "FIXED", "Building", "Family", "Style"]
