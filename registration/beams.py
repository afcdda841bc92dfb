"""Single range measurements, as they are before lines are made of them."""

from __future__ import annotations

from dataclasses import dataclass

from .layout import Floats


@dataclass(frozen=True, slots=True)
class Beams:
    """Single range measurements from one place, evidence for and against a pose.

    Attributes
    ----------
    angles : (m,) radians in the scan frame
    ranges : (m,) metres; inf where the beam came back from nothing within `range_max`; nan where nothing is known
    range_max : float
        Metres; how far a beam without return is known to be free; inf where the scanner does not say.
    """

    angles: Floats
    ranges: Floats
    range_max: float
