"""Errors of a run before it starts; an error about one scan is in that scan's row.

::

    FleetError (InputError)
    ├── UnreadableScansError   a log that is not there, or a Parquet file without scans in it
    ├── UnreadableMapsError    no map, or two of one name
    └── OtherRunError          an unfinished run of other logs, maps or options lies there, or one is at work
"""

from registration import InputError


class FleetError(InputError):
    """Root of this package's errors; `argument` names the file."""


class UnreadableScansError(FleetError):
    """A log is not there, or holds no scans that are read here."""


class UnreadableMapsError(FleetError):
    """There is no map, or it is not clear which."""


class OtherRunError(FleetError):
    """The folder of results belongs to another run."""
