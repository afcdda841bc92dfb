"""A caller's mistakes are recognised, and none is made up."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from association.causes import find_causes
from association.units import UNITS

from association import AssociationOptions, Beams, Deadline, MapIndex, Scan, associate
from association.rank_and_estimate import search_and_rank
from association.scan.scan import mirrored, scaled, turned_round
from association.to_scale import estimate_factor
from association.verdict.verdict import judge
from association.warnings import warnings_of_causes

from .scenes import INSIDE, ROOM, beams_of, context_of, index_of, maze, pose, scan_of, seen

INDEX = index_of(ROOM)
SCAN = scan_of(seen(ROOM, INSIDE)[0])


def told(scan: Scan, index: MapIndex = INDEX, **options: Any) -> dict[str, str]:
    """Return the warnings of mistakes by their codes."""
    context = context_of(index, scan, causes=True, **options)
    explanations = search_and_rank(context)
    verdict = judge(context, explanations)
    causes = find_causes(context, explanations, verdict, time.monotonic() - 60.0)  # time enough
    return {one.code: one.message for one in warnings_of_causes(causes)}


def test_nothing_is_told_of_a_scan_that_is_usable() -> None:
    assert associate(INDEX, SCAN).usable
    assert told(SCAN) == {}


def test_a_laser_upside_down() -> None:
    assert list(told(mirrored(SCAN))) == ["mirrored"]
    at = replace(SCAN, viewpoint=(0.0, 0.0), beams=beams_of(INDEX, INSIDE))
    assert list(told(mirrored(at))) == ["mirrored"]


def test_begins_and_ends_exchanged() -> None:
    assert list(told(turned_round(SCAN))) == ["reversed"]
    back = index_of(ROOM[:, [2, 3, 0, 1]])
    assert list(told(SCAN, back)) == ["reversed"]
    assert told(turned_round(SCAN), oriented=False) == {}


@pytest.mark.parametrize("factor", UNITS)
def test_other_units(factor: float) -> None:
    """What was multiplied is to be divided again."""
    assert list(told(scaled(SCAN, factor))) == ["unit_scale"]
    assert f"with all lengths times {1.0 / factor:.4g}: the" in told(scaled(SCAN, factor))["unit_scale"]


def test_feet_are_named() -> None:
    assert "seems to be in feet" in told(scaled(SCAN, 1.0 / 0.3048))["unit_scale"]


@pytest.mark.parametrize(("factor", "said"), [(25.4, "millimetres taken for inches"), (0.01, "metres taken for centi")])
def test_a_map_of_another_unit(factor: float, said: str) -> None:
    """The scan is as large as scans are: the map is divided, for gates of the search are metres."""
    found = told(SCAN, index_of(ROOM * factor))
    assert list(found) == ["unit_scale"]
    assert (
        f"The scan fits much better with all lengths times {factor:.4g}: the map seems to be in {said}"
        in found["unit_scale"]
    )


@pytest.mark.parametrize("factor", [0.93, 0.96, 1.04, 1.07])
def test_a_map_that_is_not_to_scale(factor: float) -> None:
    walls = maze(5)
    near = scan_of(seen(walls, pose(15.0, 15.0, 0.4), radius=9.0, noise=0.005)[0])
    context = context_of(index_of(walls), scaled(near, factor))
    assert estimate_factor(context) == pytest.approx(1.0 / factor, abs=0.01)
    assert estimate_factor(context_of(index_of(walls), near)) is None


def test_nothing_is_made_up_of_scans_of_other_places() -> None:
    for seed in range(6):
        walls = maze(seed, 30, 20.0)
        strange = scan_of(seen(maze(seed + 100, 30, 20.0), pose(10.0, 10.0, 1.0), radius=8.0)[0])
        assert told(strange, index_of(walls)) == {}


def test_an_option_that_is_not_taken_costs_nothing() -> None:
    found = associate(INDEX, mirrored(SCAN))
    assert not found.usable
    assert [one.code for one in found.warnings] == []


def test_the_answer_itself_stays_as_it_is() -> None:
    plain, also = (
        associate(INDEX, mirrored(SCAN)),
        associate(INDEX, mirrored(SCAN), None, AssociationOptions(causes=True)),
    )
    assert (plain.status, plain.pose, plain.reasons, plain.search) == (
        also.status,
        also.pose,
        also.reasons,
        also.search,
    )


def test_nothing_is_looked_for_past_the_deadline() -> None:
    how = AssociationOptions(causes=True)
    found = associate(INDEX, mirrored(SCAN), None, how, Deadline(time.monotonic()))
    assert "mirrored" not in [one.code for one in found.warnings]


def test_scaled_lengths() -> None:
    beams = Beams(np.array([0.0, 1.0]), np.array([2.0, math.inf]), 10.0)
    scan = scaled(replace(SCAN, viewpoint=(1.0, -2.0), beams=beams), 3.0)
    assert scan.viewpoint == (3.0, -6.0)
    assert scan.beams is not None
    assert (scan.beams.ranges.tolist(), scan.beams.range_max) == ([6.0, math.inf], 30.0)
    np.testing.assert_allclose(scan.measured.segments.lengths, 3.0 * SCAN.measured.segments.lengths)
    np.testing.assert_allclose(scan.measured.centroids, 3.0 * SCAN.measured.centroids)
    np.testing.assert_allclose(scan.measured.spreads, 9.0 * SCAN.measured.spreads)
    np.testing.assert_allclose(scan.measured.sigma, 3.0 * SCAN.measured.sigma)
