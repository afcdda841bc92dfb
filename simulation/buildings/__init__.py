"""Families of buildings to scan: each draws styles, and each style draws buildings that are sisters."""

from .building import FIXED, Building
from .families import FAMILIES, Family, Style

__all__ = ["FAMILIES", "FIXED", "Building", "Family", "Style"]
