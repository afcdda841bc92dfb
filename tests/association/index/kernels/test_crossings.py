"""Wall chains that cross are found, and listed where a scan segment would lie on each, as by the reference."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from association.index.grids import boxes_in_bands, crossing_chains, listed
from association.index.kernels import crossings
from association.index.walls import ends_of_rows
from association.layout import CROSSING, Integers
from association.tables import Crossings
from registration.layout import Records

from ...kernels.drawn import SEEDS, oblique
from ...reference import crossings as twin
from ...scenes import index_of


def boxed(chains: Records, height: float = 1.0) -> tuple[Records, Integers, Records]:
    """Return the boxes around chains, in bands of which there are some, and the order that this is."""
    return boxes_in_bands(ends_of_rows(chains), height)


def found_in(chains: Records, reach: float, most: int = 10**9) -> Records:
    out = np.zeros(len(chains) ** 2, CROSSING)
    return out[: crossings.find_crossings(chains, *boxed(chains), reach, most, out)[0]]


@given(SEEDS, st.sampled_from([4.0, 8.0, 24.0]))
@settings(max_examples=20, deadline=None)
def test_every_pair_that_crosses_is_found_once(seed: int, reach: float) -> None:
    chains = oblique(np.random.default_rng(seed)).chains.rows
    found, expected = found_in(chains, reach).tolist(), twin.crossings_of(chains, reach)
    assert len(found) == len(expected)
    assert {pair[:2] for pair in found} == expected
    little = np.zeros(3, CROSSING)
    assert crossings.find_crossings(chains, *boxed(chains), reach, 10**9, little)[0] == len(expected)
    assert little.tolist() == found[:3]


def test_looking_for_crossings_ends() -> None:
    chains = oblique(np.random.default_rng(0)).chains.rows
    whole, looks = crossings.find_crossings(chains, *boxed(chains), 64.0, 10**9, np.zeros(0, CROSSING))
    some, fewer = crossings.find_crossings(chains, *boxed(chains), 64.0, 100, np.zeros(0, CROSSING))
    assert some < whole
    assert 100 < fewer <= 100 + len(chains) < looks


def test_runs_are_found_from_one_band_to_another() -> None:
    """However high the bands are: a long chain reaches from its own into many."""
    chains = oblique(np.random.default_rng(1)).chains.rows
    found = [set(map(tuple, pairs_in(chains, 4.0, height))) for height in (0.3, 3.0, 1e9)]
    assert found[0] == found[1] == found[2] == twin.crossings_of(chains, 4.0)
    assert len(boxed(chains, 0.3)[2]) > 10
    assert len(boxed(chains, 1e9)[2]) == 1
    assert len(boxed(chains[:0])[2]) == 0


def pairs_in(chains: Records, reach: float, height: float) -> list[list[int]]:
    out = np.zeros(len(chains) ** 2, CROSSING)
    count, _ = crossings.find_crossings(chains, *boxed(chains, height), reach, 10**9, out)
    return out[["first", "second"]][:count].tolist()


@given(SEEDS)
@settings(max_examples=10, deadline=None)
def test_what_is_sampled_tells_how_many_there_are(seed: int) -> None:
    """Of every chain exactly; of each second one about; no more than a number of looks allows."""
    chains, reaches = oblique(np.random.default_rng(seed)).chains.rows, np.array([24.0, 8.0, 4.0])
    exact = crossings.sample_crossings(chains, *boxed(chains), reaches, 1, 10**9)
    np.testing.assert_allclose(exact[:, :2], [twin.counts_of(chains, reach) for reach in reaches])
    assert (np.diff(exact[:, 2]) <= 0.0).all()
    half = crossings.sample_crossings(chains, *boxed(chains), reaches, 2, 10**9)
    np.testing.assert_allclose(half, exact, rtol=0.8)
    few = crossings.sample_crossings(chains, *boxed(chains), reaches, 1, 10)
    assert (few[:, 2] <= 10.0 * len(chains)).all()


@given(SEEDS, st.sampled_from([5.0, 16.0]))
@settings(max_examples=20, deadline=None)
def test_a_crossing_is_listed_in_all_cells_that_its_runs_reach_into(seed: int, reach: float) -> None:
    chains = oblique(np.random.default_rng(seed)).chains.rows
    found = listed(chains, found_in(chains, reach), reach)
    columns, grids = int(found.shape["columns"][0]), found.bins.tolist()
    got: dict[tuple[int, int], set[tuple[int, int, int]]] = {}
    for cell, (begin, end) in enumerate(zip(found.starts[:-1], found.starts[1:], strict=True)):
        grid, place = divmod(cell, columns**2)
        for p, q, code in found.entries[begin:end].tolist():
            got.setdefault((p, q), set()).add((grids.index(grid), *divmod(place, columns)))
            assert code == crossings.code_of(*twin.extents(chains[p], chains[q]), reach)
    assert set(got) == twin.crossings_of(chains, reach)
    for (p, q), cells in got.items():
        expected = twin.cells_of(twin.extents(chains[p], chains[q]), reach)
        assert cells == {(twin.angle_bin(chains[p], chains[q]), *cell) for cell in expected}
    assert sum(map(len, got.values())) == len(found.entries)


def test_where_too_many_cross_none_is_listed() -> None:
    """A thousand chains through one place, in all directions."""
    angles = np.linspace(0.0, 2.0 * math.pi, 1000, endpoint=False)
    middles, half = (
        np.random.default_rng(0).uniform(-1.0, 1.0, (1000, 2)),
        np.stack([np.cos(angles), np.sin(angles)], 1),
    )
    index = index_of(np.hstack([middles - 2.0 * half, middles + 2.0 * half]))
    assert len(index.sweep.chains) > 900
    assert index.crossings.shape["reach"][0] < 0.0
    assert len(index.crossings.entries) == 0


@pytest.mark.parametrize(("count", "reach"), [(1, 8.0), (20, 64.0), (200, 32.0)])
def test_the_more_there_are_the_less_far_they_are_listed(count: int, reach: float) -> None:
    """Rows of rooms: from one end to the other, or as far as memory allows; the same for the same chains."""
    room = np.array([[0.0, 0.0, 4.0, 0.0], [4.0, 0.0, 4.0, 3.0], [4.0, 3.0, 0.0, 3.0], [0.0, 3.0, 0.0, 0.0]])
    rooms = [room + np.tile([5.0 * k, y], 2) for k in range(count) for y in (0.0, 4.0)]
    index = index_of(np.vstack(rooms))
    again: Crossings = crossing_chains(index.sweep.chains)
    assert index.crossings.shape["reach"][0] == reach
    for one, other in zip(index.crossings, again, strict=True):
        np.testing.assert_array_equal(one, other)
