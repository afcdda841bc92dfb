"""Errors of vectorization.

::

    VectorizationError (InputError)
    ├── InvalidScanError         ranges, angles or points that are no scan
    └── InvalidOptionError       an option out of its range
"""

from registration import InputError


class VectorizationError(InputError):
    """Root of this package's errors."""


class InvalidScanError(VectorizationError):
    """Ranges, angles or points are no scan."""


class InvalidOptionError(VectorizationError):
    """An option is out of its range."""
