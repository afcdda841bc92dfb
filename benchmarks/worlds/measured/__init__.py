"""Answers to scans of drawn worlds that were not used for tuning, and to out-of-map scans: tables and goals."""

from .report import worlds

__all__ = ["worlds"]
