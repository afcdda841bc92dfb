"""What an analysis refuses.

::

    registration.InputError
    └── AnalysisError   something about the robot or its places is out of range
"""

from __future__ import annotations

from registration import InputError


class AnalysisError(InputError):
    """Something about the robot or its places is out of range."""
