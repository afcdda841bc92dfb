"""An offset that all walls share: grids whose walls are thick, and lasers that read too far or too near."""

from __future__ import annotations

import pytest

from association import AssociationOptions, Deadline, MapIndex, Scan, associate
from association.consensus.common_offset import CommonOffset, fit_common_offset
from association.context import SearchContext
from association.rank_and_estimate import search_and_rank
from registration import Segments

from ...map_quality.check.drawn import faces, sampled
from ..scenes import pose_in, same_pose, squared_error, warning_codes

SIGMA = 0.025


def index_with(distance: float, sigma: float | None = SIGMA, *, oriented: bool = True) -> MapIndex:
    """Return the index of a floor whose walls are all that far behind their faces."""
    return MapIndex.build(Segments.from_array(faces()).moved_left(-distance), sigma, oriented=oriented)


def fitted(index: MapIndex, scan: Scan, *, oriented: bool = True) -> CommonOffset | None:
    context = SearchContext.of(index, scan, None, AssociationOptions(oriented=oriented), Deadline())
    answer = search_and_rank(context).answer
    assert answer is not None
    return fit_common_offset(context, answer.best, answer.estimated.wall_sigma)


@pytest.mark.parametrize("distance", [0.05, -0.05])
def test_walls_that_are_all_displaced_do_not_move_the_pose(distance: float) -> None:
    """The covariance holds: 16.3 is the quantile of 0.1 % of a chi-square of three."""
    usable = 0
    for truth, scan in sampled():
        found = associate(index_with(distance), scan)
        usable += found.usable
        assert same_pose(pose_in(found), truth, 0.01, 0.005)
        assert squared_error(found, truth) < 16.3
        assert warning_codes(found) == ["common_offset"]
    assert usable >= 5


def test_the_offset_is_estimated_with_its_deviation() -> None:
    for _, scan in sampled():
        found = fitted(index_with(0.05), scan)
        assert found is not None
        assert abs(found.offset - 0.05) < 3.0 * found.deviation < 0.06
        assert abs(found.factor - 1.0) < 3.0 * found.factor_deviation


def test_walls_where_the_map_has_them_have_no_offset() -> None:
    """The pose is then the one at which the pairs register."""
    for _, scan in sampled():
        assert fitted(index_with(0.0), scan) is None


@pytest.mark.parametrize("sigma", [None, 0.0])
def test_without_a_sigma_of_the_map_nothing_is_known_of_it(sigma: float | None) -> None:
    assert fitted(index_with(0.05, sigma), sampled()[0][1]) is None


def test_the_free_side_of_a_wall_is_where_the_sensor_is() -> None:
    """Segments without a direction, seen from a known place; without that, both signs are as likely."""
    index, scan = index_with(0.05, oriented=False), sampled()[0][1]
    found = fitted(index, scan, oriented=False)
    assert found is not None
    assert found.offset > 0.03
    assert fitted(index, Scan(scan.measured, None, None), oriented=False) is None


def test_a_factor_is_no_offset() -> None:
    """A map that is 3 % too large is off by more where the walls are far."""
    index = MapIndex.build(Segments.from_array(1.03 * faces()), SIGMA)
    told = [code for _, scan in sampled() for code in warning_codes(associate(index, scan))]
    assert told.count("map_scale") >= 3
    assert told.count("common_offset") <= 1
