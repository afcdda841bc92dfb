"""Fleets of logs: millions of scans searched in blocks, by processes or on Ray, from Parquet or bags to Parquet.

::

    running             associate_many: lay out, search, put together
    logs, blocks        logs to Parquet files whose row groups are blocks; the scans of one block
    maps                which map a scan lies on
    searching           one block's scans to rows
    parts               the results so far, from which a run that was killed continues
    processes, on_ray   the workers

The extra ``linefix[batch]`` brings the libraries, ``linefix[ray]`` Ray besides.
"""

from .engine import Engine, Lost
from .errors import FleetError, OtherRunError, UnreadableMapsError, UnreadableScansError
from .logs import LogNote
from .on_ray import OnRay
from .processes import Processes
from .running import Progress, Summary, associate_many
from .searching import FleetOptions
from .tables import POSES

__all__ = [
    "POSES",
    "Engine",
    "FleetError",
    "FleetOptions",
    "LogNote",
    "Lost",
    "OnRay",
    "OtherRunError",
    "Processes",
    "Progress",
    "Summary",
    "UnreadableMapsError",
    "UnreadableScansError",
    "associate_many",
]
