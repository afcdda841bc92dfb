"""What the kernels are handed to choose bases, and to tell when enough of them have been gone through: as `tables`."""

from __future__ import annotations

from typing import NamedTuple

from registration.layout import Floats, Records

from ..layout import Integers
from ..tables import Crossings, Walls


class Samples(NamedTuple):
    """Sampled consensus sets: orders of the n segments that bases are made of, the first of each being the set.

    Attributes
    ----------
    orders : (s, n) the segments of each
    ranks : (n, s) the places of each segment in them
    found : (s,) up to which place each has a base that was gone through, n where it has none
    sizes : (s,) how many are in each set
    gains : (s,) what they come to, nats
    undecided : (s + 1,) those of which none is known to hold a base; at last, how many these are
    """

    orders: Integers
    ranks: Integers
    found: Integers
    sizes: Integers
    gains: Floats
    undecided: Integers


class Costs(NamedTuple):
    """What the bases of n scan segments cost.

    Attributes
    ----------
    crossings : Crossings
        Of the map.
    figure : (1,) of `FIGURE`
        To write to.
    no_lists : (0,) of `LISTED`
        For crossings are only counted.
    runs : Walls
        Of the map.
    known : (1,) whether what follows, of bases that are swept, was written: in a small map none is
    lines : (n,) of `LINE_COST`
    slides : (n, bins) how far each could slide on the runs of each direction bin, metres
    smooth : (n, 2 bins) the same with the neighbouring bins, twice around: a bin that is turned needs no division to be
        found
    taken : (n, bins) the bins where it can, as many as there are
    scale : float
        Hypotheses for a metre's slide of one on one of the other, 1/m^2.
    """

    crossings: Crossings
    figure: Records
    no_lists: Records
    runs: Walls
    known: Integers
    lines: Records
    slides: Floats
    smooth: Floats
    taken: Integers
    scale: float


class Planning(NamedTuple):
    """What the bases of a scan are planned by.

    Attributes
    ----------
    runs : Walls
        Of the map.
    area : float
        Of the map, m^2.
    orders : (s, n) as in `Samples`, n being how many segments bases are made of
    ranks : (n, s) as in `Samples`
    fade : float
        As in `Plan`.
    noise : (k,) what is added to the merits of bases that are drawn at random; empty where they are not
    """

    runs: Walls
    area: float
    orders: Integers
    ranks: Integers
    fade: float
    noise: Floats


class Plan(NamedTuple):
    """The bases of a scan, and what tells when enough of them have been gone through.

    Attributes
    ----------
    bases : (k,) of `BASE`
    costs : Costs
        By which those are weighed whose turn may have come.
    uses : (n,) how often each of the first n scan segments was part of a base so far
    residual : (all scan segments,) what is left of each gain in the bound, nats
    best_gains : (n,) the gains of the first n, the largest first, nats
    freest : (all scan lines,) those that take most freedom by themselves first
    samples : Samples
        Consensus sets that may have missed all bases so far.
    fade : float
        What the logarithm of a base's merit loses for each earlier use of one of its segments.
    random : bool
        Whether the bases are drawn at random.
    """

    bases: Records
    costs: Costs
    uses: Floats
    residual: Floats
    best_gains: Floats
    freest: Integers
    samples: Samples
    fade: float
    random: bool
