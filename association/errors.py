"""What association refuses.

::

    AssociationError (InputError)
    ├── InvalidMapError      the map is empty, too wide, or its sigma out of range
    └── InvalidSearchError   a scan, prior or option out of range
"""

from registration import InputError


class AssociationError(InputError):
    """Root of this package's errors."""


class InvalidMapError(AssociationError):
    """The map cannot be searched."""


class InvalidSearchError(AssociationError):
    """The scan, the prior or an option is out of range."""
