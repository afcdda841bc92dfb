"""Crossings on which a base may lie are looked up: none that is listed is missed, and none is met twice.

That what is met is all that there is `test_proposing` holds.
"""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from association.grids import crossing_runs, listed
from association.kernels import crossings, looking_up
from association.kernels.sweeping import measure
from association.layout import CROSSING, FIGURE, LISTED, MET, WALL, record
from association.tuning import AT_ONCE, CROSSING_ANGLES, MOST_LISTS
from registration.layout import Record, Records

from ..reference import crossings as twin
from .drawn import GATES, SEEDS, drawn, oblique

ABSCISSAE = st.floats(-30.0, 30.0)


def figure_of(a: Record, b: Record) -> Records:
    """Return what is asked for of a base of two scan segments, in the order that has the second left of the first."""
    figure, left = record(FIGURE), a["dx"] * b["dy"] > a["dy"] * b["dx"]
    measure(*((a, b) if left else (b, a)), GATES[0], figure[0])
    return figure


@given(*[ABSCISSAE] * 8)
@settings(max_examples=300, deadline=None)
def test_what_reaches_far_enough_fits_by_its_code(
    a: float, b: float, c: float, d: float, e: float, f: float, g: float, h: float
) -> None:
    """And of what does not by more than a step of the code nothing does, as far as the lists go."""
    reach = 16.0
    runs, asked = (min(a, b), max(a, b), min(c, d), max(c, d)), (min(e, f), max(e, f), min(g, h), max(g, h))
    wanted = looking_up.TOP_BITS | crossings.code_of(*asked, reach)
    fits = (wanted - crossings.code_of(*runs, reach)) & looking_up.TOP_BITS == looking_up.TOP_BITS
    short = [runs[0] - asked[0], asked[1] - runs[1], runs[2] - asked[2], asked[3] - runs[3]]
    if max(short) <= 0.0:
        assert fits
    step = 2.0 * reach / crossings.STEPS
    inside = [max(-reach, min(reach, value)) for value in (*runs, *asked)]
    lacking = [inside[0] - inside[4], inside[5] - inside[1], inside[2] - inside[6], inside[7] - inside[3]]
    if max(lacking) > 1.01 * step:
        assert not fits


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_what_is_beyond_the_lists_is_not_listed(seed: int) -> None:
    """Also at an angle at which there is nothing within them."""
    d = drawn(seed)
    nothing, lists = listed(np.zeros(0, WALL), np.zeros(0, CROSSING), 4.0), np.zeros(MOST_LISTS, LISTED)
    beyond = 0
    for i, a in enumerate(d.scan):
        for b in d.scan[i + 1 :]:
            figure = figure_of(a, b)
            if abs(math.sin(figure["turn"][0])) < 0.3:
                continue
            count, entries = looking_up.look_up(figure[0], nothing, lists)
            middles = twin.extents_of_segments(a, b)
            near = max(abs(middle) - 0.5 * one["length"] for middle, one in zip(middles, (a, b), strict=True))
            assert count == 0
            assert entries in (0, -1)
            if near > 4.0:
                assert entries == -1
                beyond += 1
    assert beyond > 0 or len(d.scan) < 8


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_crossings_are_met_in_pieces_as_at_once(seed: int) -> None:
    """However little room there is, as long as some entries fit."""
    d = drawn(seed)
    runs = oblique(d.rng).runs.rows
    found, lists = crossing_runs(runs), np.zeros(MOST_LISTS, LISTED)
    a, b = d.scan[:2]
    if abs(a["dx"] * b["dy"] - a["dy"] * b["dx"]) < 0.3:
        return
    figure = figure_of(a, b)
    figure["half_a"] = figure["half_b"] = -1.0  # so that much fits
    count, entries = looking_up.look_up(figure[0], found, lists)
    met: dict[int, list[tuple[int, int]]] = {}
    for room in (AT_ONCE, looking_up.LEAST_AT_ONCE):
        at, met[room] = 0, []
        while at < entries:
            some = np.zeros(room, MET)
            at, n = looking_up.on_crossings(figure[0], found, runs, lists, count, at, some)
            met[room] += some[["run", "entry"]][:n].tolist()
    assert met[AT_ONCE] == met[looking_up.LEAST_AT_ONCE]
    assert len(met[AT_ONCE]) == len({run for run, _ in met[AT_ONCE]})  # on whichever lists it is, once


def test_bins_of_angles_have_a_right_angle_in_the_middle_of_one() -> None:
    assert CROSSING_ANGLES % 2 == 1
