"""How much reading one map may take."""

from __future__ import annotations

from dataclasses import dataclass

CPU_SECONDS = 20  # of a processor
NO_ROOM = 3  # status of the process that reads where its files cannot be written


@dataclass(frozen=True, slots=True)
class Bounds:
    """How much reading one map may take.

    Attributes
    ----------
    memory_bytes : int
        Of the process that reads.
    file_bytes : int
        Of one file.
    segments : int
        Of the map.
    cpu_seconds : int
        Of a processor.
    """

    memory_bytes: int
    file_bytes: int
    segments: int
    cpu_seconds: int = CPU_SECONDS
