"""The arrays that the kernels of the search exchange; `association.tables` has those that stages share."""

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
    found : (s,) up to which place each holds a base that was searched, n where it holds none
    sizes : (s,) how many segments are in each set
    gains : (s,) the sum of their gains, nats
    undecided : (s + 1,) the sets of which none is known to hold a searched base; at last, how many these are
    """

    orders: Integers
    ranks: Integers
    found: Integers
    sizes: Integers
    gains: Floats
    undecided: Integers


class Costs(NamedTuple):
    """The costs of searching the bases of n scan segments.

    Attributes
    ----------
    crossings : Crossings
        Of the map.
    figure : (1,) of `FIGURE`
        To write to.
    no_lists : (0,) of `LISTED`
        For crossings are only counted.
    chains : Walls
        Of the map.
    known : (1,) whether what follows, of bases that are swept, was written: in a small map no base is swept
    lines : (n,) of `LINE_COST`
    slides : (n, bins) how far each could slide on the chains of each direction bin, metres
    smooth : (n, 2 bins) the same with the neighbouring bins, twice around: a rotated bin needs no division to be found
    taken : (n, bins) the bins where it can slide, as many as there are
    scale : float
        Hypotheses for a metre's slide of one on one of the other, 1/m^2.
    """

    crossings: Crossings
    figure: Records
    no_lists: Records
    chains: Walls
    known: Integers
    lines: Records
    slides: Floats
    smooth: Floats
    taken: Integers
    scale: float


class Sampling(NamedTuple):
    """By which a plan is made.

    Attributes
    ----------
    chains : Walls
        Of the map.
    area : float
        Of the map, m^2.
    orders : (s, n) as in `Samples`, n being the number of segments that bases are made of
    ranks : (n, s) as in `Samples`
    fade : float
        As in `Plan`.
    noise : (k,) terms added to the merits of bases that are drawn at random; empty where they are not
    """

    chains: Walls
    area: float
    orders: Integers
    ranks: Integers
    fade: float
    noise: Floats


class Plan(NamedTuple):
    """The bases of a scan, and the state of the stopping rule.

    Attributes
    ----------
    bases : (k,) of `BASE`
    costs : Costs
        By which those bases are weighed that may come next.
    uses : (n,) how often each of the first n scan segments was part of a base so far
    residual : (all scan segments,) the rest of each gain in the bound, nats
    best_gains : (n,) the gains of the first n, the largest first, nats
    freest : (all scan lines,) those that take most freedom by themselves first
    samples : Samples
        Consensus sets that all bases so far may have missed.
    fade : float
        Decrease of the logarithm of a base's merit for each earlier use of one of its segments.
    random : bool
        True if the bases are drawn at random.
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


class SearchState(NamedTuple):
    """The state of a search so far.

    Attributes
    ----------
    poses : (k,) of `FOUND`, the best poses in no order
    best : (1,) of `BEST`
    statistics : (1,) of `STATISTICS`
    stop : (1,) not 0 once the search has to end; written by another thread, hence read again for each hypothesis
    """

    poses: Records
    best: Records
    statistics: Records
    stop: Integers


class Sweeps(NamedTuple):
    """Room for the stages of a sweep, of `AT_ONCE` each.

    Attributes
    ----------
    laid : (k,) of `LAID`
    swept : (k,) of `SWEPT`
    met : (k,) of `MET`
    """

    laid: Records
    swept: Records
    met: Records
