"""Errors of association.

::

    AssociationError (InputError)
    ├── InvalidMapError      the map is empty, too wide, or its sigma out of range
    └── InvalidSearchError   a scan, prior or option out of range

    IndexingEndedError           a deadline passed, or was cancelled, before a map was indexed
"""

from registration import InputError


class AssociationError(InputError):
    """Root of this package's errors."""


class InvalidMapError(AssociationError):
    """The map cannot be searched."""


class InvalidSearchError(AssociationError):
    """The scan, the prior or an option is out of range."""


class IndexingEndedError(Exception):
    """A deadline passed, or was cancelled, before a map was indexed; there is no index."""

    def __init__(self) -> None:
        super().__init__("the deadline passed before the map was indexed")
