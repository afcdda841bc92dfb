"""What the kernels are handed to go on from a search to a verdict, and what they write to: as `tables`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from registration.layout import Floats, Records

from .layout import (
    BEND,
    CHANCES,
    CURVE,
    ESTIMATE,
    FACTS,
    FEATURES,
    GATES,
    HINGE,
    MATCH,
    MERIT,
    POINT,
    REACHED,
    SETTLED,
    SIGHTING,
    TWO_FEATURES,
    VARIANCES,
    WALL,
    Integers,
)
from .tables import KnownWalls, Measured, Odds, Sights


class WallLengths(NamedTuple):
    """How much wall there is: what chance goes by.

    Attributes
    ----------
    ascending : (m,) their lengths, metres
    beyond : (m + 1,) the sums of those from each on, metres
    agreeing : float
        The chance that two points of walls have the same direction.
    area : float
        Of the map, m^2.
    """

    ascending: Floats
    beyond: Floats
    agreeing: float
    area: float


class Told(NamedTuple):
    """What is written of an answer.

    Attributes
    ----------
    reached : (1,) of `REACHED`
    estimates : (k,) of `ESTIMATE`, of the explanations, the best first
    merits : (k,) of `MERIT`
    matches : (k, n) of `MATCH`
    settled : (1,) of `SETTLED`, the best of them
    hinges : (n,) of `HINGE`
    facts : (1,) of `FACTS`
    features : (1,) of `FEATURES`
    chances : (1,) of `CHANCES`
    """

    reached: Records
    estimates: Records
    merits: Records
    matches: Records
    settled: Records
    hinges: Records
    facts: Records
    features: Records
    chances: Records

    @classmethod
    def room(cls, answers: int, explanations: int, lines: int) -> Told:
        """Return room for so many answers, 1 or none, and explanations of a scan of so many lines."""
        return cls(
            np.empty(answers, REACHED),
            np.empty(explanations, ESTIMATE),
            np.empty(explanations, MERIT),
            np.empty((explanations, lines), MATCH),
            np.empty(answers, SETTLED),
            np.empty(lines, HINGE),
            np.empty(answers, FACTS),
            np.empty(answers, FEATURES),
            np.empty(answers, CHANCES),
        )


class Answering(NamedTuple):
    """What an answer that is worked out in one call goes by beside the search, and where it is written.

    Attributes
    ----------
    sights : Sights
    seen : (k,) of `SIGHTING`, of which there may be no lines of sight
    known_walls : KnownWalls
    lengths : WallLengths
    gates : (1,) of `GATES`
    exponents : (m,) of Chernoff's bound, ascending
    measured : Measured
    variances : (1,) of `VARIANCES`
    orders, ranks : as in `Samples`, for the search of the mirrored scan
    usual, cautious : Odds
    usual_deviation : float
        Of the position of a usual right answer, along its weakest direction, m.
    counted : bool
        Whether the scan's points were counted.
    to_scale : bool
        Whether a factor between scan and map may be looked for.
    told : Told
    """

    sights: Sights
    seen: Records
    known_walls: KnownWalls
    lengths: WallLengths
    gates: Records
    exponents: Floats
    measured: Measured
    variances: Records
    orders: Integers
    ranks: Integers
    usual: Odds
    cautious: Odds
    usual_deviation: float
    counted: bool
    to_scale: bool
    told: Told

    @classmethod
    def nothing(cls) -> Answering:
        """Return that the search is all that is asked."""
        points, numbers, counts = np.zeros(0, POINT), np.zeros(0), np.zeros((0, 0), np.uint8)
        # Kernels are compiled once more for what may be written to; what is measured may not.
        measured = [np.zeros(0, kind) for kind in (POINT, POINT, float, POINT, float, float, float)]
        parallel = np.zeros(0)
        for array in (*measured, parallel):
            array.setflags(write=False)
        odds = Odds(np.zeros(0, CURVE), np.zeros(0, BEND), np.zeros(0, TWO_FEATURES))
        return cls(
            Sights(points, np.zeros(0, np.int64), np.zeros(0, SIGHTING)),
            np.zeros(0, SIGHTING),
            KnownWalls(np.zeros(0, WALL), -1.0, parallel),
            WallLengths(numbers, numbers, 0.0, 0.0),
            np.zeros(0, GATES),
            numbers,
            Measured(*measured),
            np.zeros(0, VARIANCES),
            counts,
            counts,
            odds,
            odds,
            0.0,
            False,
            False,
            Told.room(0, 0, 0),
        )
