"""Fleets of logs: millions of scans searched in blocks, by processes or on Ray, from Parquet or bags to Parquet.

::

    running             associate_many: lay out, search, put together
    logs, blocks        logs to Parquet files whose row groups are blocks; the scans of one block
    searching           which map a scan lies on; one block's scans to rows
    parts               the results so far, from which a run that was killed continues
    engine              the workers: processes of this machine, or those of Ray
    tables              the columns of input and output

The extra ``linefix[batch]`` brings the libraries, ``linefix[ray]`` Ray besides.
"""

from .engine import Engine, Lost, OnRay, Processes
from .errors import FleetError, OtherRunError, UnreadableMapsError, UnreadableScansError
from .logs import LogNote
from .running import Summary, associate_many
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
    "Summary",
    "UnreadableMapsError",
    "UnreadableScansError",
    "associate_many",
]
