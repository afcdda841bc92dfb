"""Parts that answers of several routes have."""

from __future__ import annotations

from typing import Any

from association import WarningCode

from .strict import Answer, Milliseconds


class TimingAnswer(Answer):
    """Duration of the request, milliseconds.

    Attributes
    ----------
    decode
        from the arrival of the body until the search: reading, waiting, indexing
    search
        the search, or the other computation of this request
    total
        from the arrival of the body until the answer is written
    """

    decode: Milliseconds
    search: Milliseconds
    total: Milliseconds


class SealedAnswer(Answer):
    """Fields that each answer ends with."""

    request_id: str
    timing_ms: TimingAnswer


class ReferencedAnswer(SealedAnswer):
    """The same, with the reference of the request.

    Attributes
    ----------
    client_ref
        returned as it was sent
    """

    client_ref: Any


class PoseAnswer(Answer):
    """The scan frame's pose in the map frame.

    Attributes
    ----------
    x, y
        metres
    theta
        radians, counter-clockwise, in (-pi, pi]
    """

    x: float
    y: float
    theta: float


class WarningAnswer(Answer):
    """A warning about the scan, the map or the search.

    Attributes
    ----------
    code
        stable; later versions may add codes
    message
        fault and remedy, for people
    """

    code: WarningCode
    message: str


class MapReference(Answer):
    """Which map was searched; of several maps that of the pose.

    Attributes
    ----------
    revision
        of a stored map; null: the map came with the request
    """

    map_id: str
    revision: int | None
