"""Arguments of the kernels: arrays that belong together."""

from __future__ import annotations

from typing import NamedTuple

from .layout import Floats


class Drawn(NamedTuple):
    """Segments as they are drawn.

    Attributes
    ----------
    directions, midpoints : (k, 2) unit vectors, and metres
    lengths : (k,) metres
    """

    directions: Floats
    midpoints: Floats
    lengths: Floats


class Points(NamedTuple):
    """The points behind segments.

    Attributes
    ----------
    centroids : (k, 2) their mean, metres
    spreads : (k,) their second moment along the segment, m^2
    sigmas : (k,) standard deviation of one of them normal to the wall, metres
    counts : (k,) how many they are
    """

    centroids: Floats
    spreads: Floats
    sigmas: Floats
    counts: Floats
