"""Crossings on which a base may lie are looked up: none that is listed is missed, and none is met twice.

That what is met is all that there is `test_proposing` holds.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from association.index.grids import crossing_chains, listed
from association.index.kernels import crossings
from association.layout import CROSSING, FIGURE, WALL, record
from association.search.kernels import lookup
from association.search.kernels.sweeping import measure
from association.search.layout import LISTED, MET
from association.search.tuning import MOST_LISTS
from association.tables import Crossings
from association.tuning import AT_ONCE, CROSSING_ANGLES
from registration.layout import Record, Records

from ...kernels.drawn import GATES, INDEX, SEEDS, drawn, oblique
from ...reference import crossings as twin
from ...scenes import context_of, index_of, scan_of

ABSCISSAE = st.floats(-30.0, 30.0)


def figure_of(a: Record, b: Record) -> Records:
    """Return the look-up of a base of two scan segments, with the second one left of the first."""
    figure, left = record(FIGURE), a["dx"] * b["dy"] > a["dy"] * b["dx"]
    measure(*((a, b) if left else (b, a)), GATES[0], figure[0])
    return figure


def lines_of(first: list[float], second: list[float]) -> Records:
    """Return two lines of a scan, the longer one first."""
    return context_of(INDEX, scan_of([first, second])).lines.rows


def all_of(chains: Records, reach: float) -> Crossings:
    """List all crossings of chains up to `reach` metres."""
    pairs = [(first, second, 0) for first, second in sorted(twin.crossings_of(chains, reach))]
    return listed(chains, np.array(pairs, CROSSING), reach)


def met_by(figure: Records, found: Crossings, chains: Records) -> int:
    """Return how many crossings are met on the lists of a base, or -1 where not all that matter are listed."""
    lists, met = np.zeros(MOST_LISTS, LISTED), np.zeros(AT_ONCE, MET)
    count, entries = lookup.look_up(figure[0], found, lists)
    return int(lookup.on_crossings(figure[0], found, chains, lists, count, 0, met)[1]) if entries >= 0 else -1


@given(*[ABSCISSAE] * 8)
@settings(max_examples=300, deadline=None)
def test_what_reaches_far_enough_fits_by_its_code(
    a: float, b: float, c: float, d: float, e: float, f: float, g: float, h: float
) -> None:
    """And of what does not by more than a step of the code nothing does, as far as the lists go."""
    reach = 16.0
    chains, asked = (min(a, b), max(a, b), min(c, d), max(c, d)), (min(e, f), max(e, f), min(g, h), max(g, h))
    wanted = lookup.TOP_BITS | crossings.code_of(*asked, reach)
    fits = (wanted - crossings.code_of(*chains, reach)) & lookup.TOP_BITS == lookup.TOP_BITS
    short = [chains[0] - asked[0], asked[1] - chains[1], chains[2] - asked[2], asked[3] - chains[3]]
    if max(short) <= 0.0:
        assert fits
    step = 2.0 * reach / crossings.STEPS
    inside = [max(-reach, min(reach, value)) for value in (*chains, *asked)]
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
            count, entries = lookup.look_up(figure[0], nothing, lists)
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
    chains = oblique(d.rng).chains.rows
    found, lists = crossing_chains(chains), np.zeros(MOST_LISTS, LISTED)
    a, b = d.scan[:2]
    if abs(a["dx"] * b["dy"] - a["dy"] * b["dx"]) < 0.3:
        return
    figure = figure_of(a, b)
    figure["half_a"] = figure["half_b"] = -1.0  # so that much fits
    count, entries = lookup.look_up(figure[0], found, lists)
    met: dict[int, list[int]] = {}
    for room in (AT_ONCE, lookup.LEAST_AT_ONCE):
        at, met[room] = 0, []
        while at < entries:
            some = np.zeros(room, MET)
            at, n = lookup.on_crossings(figure[0], found, chains, lists, count, at, some)
            met[room] += some["number"][:n].tolist()
    assert met[AT_ONCE] == met[lookup.LEAST_AT_ONCE]
    assert len(met[AT_ONCE]) == len(set(met[AT_ONCE]))  # on whichever lists it is, once


def test_bins_of_angles_have_a_right_angle_in_the_middle_of_one() -> None:
    assert CROSSING_ANGLES % 2 == 1


def test_at_a_right_angle_a_segment_is_nearer_than_at_the_edges_of_the_bin() -> None:
    """By 2 cm in 30 m, which decides where a cell of the lists ends.

    The angle of the first segment is known, so that nothing else widens the look-up.
    """
    chains = index_of([[-9.0, 0.0, 9.0, 0.0], [0.0, 20.0, 0.0, 40.0]]).chains.rows
    found, cells = all_of(chains, 32.0), set()
    for middle in 29.7 + 0.003 * np.arange(60):
        a, b = lines_of([-1.5, 0.0, 1.5, 0.0], [0.0, middle - 0.5, 0.0, middle + 0.5])
        a["angle_variance"], b["angle_variance"] = 1e-9, 1e-3
        figure, lists = figure_of(a, b), np.zeros(MOST_LISTS, LISTED)
        assert figure["half_b"][0] > 0.0
        assert met_by(figure, found, chains) == 1
        count, _ = lookup.look_up(figure[0], found, lists)
        cells |= set(lists["row"][:count].tolist())
    assert len(cells) == 2


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("first", [False, True])
def test_where_the_far_end_is_beyond_the_lists_the_near_one_is_deciding_place(side: float, first: bool) -> None:
    """Be it of the first segment or of the second; if both are beyond, nothing is found."""
    up = 1.0 if not first else -1.0  # the long one is to the left of the other, or the other to the left of it
    chains = index_of([[-2.0, 0.0, 2.0, 0.0], [0.0, 15.0 * (side - up), 0.0, 15.0 * (side + up)]]).chains.rows
    found = all_of(chains, 4.0)
    for middle, expected in ((5.0, 1), (23.0, -1)):
        long, short = lines_of([0.0, side * middle - 3.0 * up, 0.0, side * middle + 3.0 * up], [-1.0, 0.0, 1.0, 0.0])
        figure = figure_of(long, short)
        half = figure["half_a" if first else "half_b"][0]
        assert middle + half > 4.0
        assert (middle - half < 4.0) == (expected == 1)
        assert met_by(figure, found, chains) == expected


def test_a_base_that_would_ask_for_too_many_lists_is_swept() -> None:
    """Hardly anything is known of the angles of its segments, which are far from where they cross."""
    angles = np.radians(np.arange(6.0, 90.0, 4.0))
    rays = 60.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    chains = index_of(np.vstack([[[-60.0, 0.0, 60.0, 0.0]], np.hstack([-rays, rays])])).chains.rows
    found = all_of(chains, 64.0)
    a, b = lines_of([-1.5, 0.0, 1.5, 0.0], [16.0, 16.0, 17.0, 17.0])
    for variance, told in ((1e-6, True), (1.0, False)):
        a["angle_variance"] = b["angle_variance"] = variance
        figure, lists = figure_of(a, b), np.zeros(9 * MOST_LISTS, LISTED)
        count, entries = lookup.look_up(figure[0], found, lists)
        assert count <= MOST_LISTS
        assert (count > 0 and entries > 0) if told else (count, entries) == (0, -1)
        # As when it is only asked how many there are.
        assert lookup.look_up(figure[0], found, lists[:0]) == (0, entries)
