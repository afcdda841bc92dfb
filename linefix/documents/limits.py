"""Limits of the size of a request."""

from __future__ import annotations

from dataclasses import dataclass

from pydantic import ValidationInfo

from .errors import TooManyError

MAX_FAULTS = 20  # wrong places that are reported of one request


@dataclass(frozen=True, slots=True)
class Limits:
    """Counts beyond which a request is refused; the context that requests are validated in.

    Attributes
    ----------
    values : int
        Numbers, strings, arrays and objects in the whole request.
    map_segments, scan_segments : int
        Of one map, of one scan.
    beams : int
        Ranges or points of one scan.
    pairs : int
        Correspondences, or weights, of one registration.
    batch : int
        Scans of one batch.
    views : int
        Of one scan.
    beams_together, segments_together : int
        Ranges or points, and segments, of all views of one scan.
    """

    values: int = 2_000_000
    map_segments: int = 200_000
    scan_segments: int = 2_000
    beams: int = 20_000
    pairs: int = 200_000
    batch: int = 256
    views: int = 64
    beams_together: int = 100_000
    segments_together: int = 10_000


def require_within(info: ValidationInfo, name: str, count: int, what: str, pointer: str = "") -> None:
    """Refuse more of something than one of the limits; what is stored is read without limits.

    Raises
    ------
    TooManyError
        With the pointer to the part that there is too much of, and what that is.
    """
    limits: Limits | None = info.context
    if limits is not None and count > getattr(limits, name):
        raise TooManyError(pointer, getattr(limits, name), what)
