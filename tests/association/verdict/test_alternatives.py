"""In a building that repeats itself centimetres tell nothing where its map is centimetres off."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
import pytest

from association import AssociationResult, Deadline
from association.consensus.consensus_set import ConsensusSet
from association.context import SearchContext
from association.explanations import Answer
from association.rank_and_estimate import search_and_rank
from association.verdict.alternatives import (
    AmongAlternatives,
    compare_alternatives,
    probability_among,
    probability_by_shown,
    probability_with_loose_walls,
)
from association.verdict.tuning import ABSENCE, LOOSE_TEMPERATURE
from registration import Segments

from ..scenes import INSIDE, ROOM, answer_of, beams_of, context_of, equal_rooms, index_of, pose, scan_of, seen

SCAN = scan_of(seen(ROOM, INSIDE)[0], viewpoint=(0.0, 0.0))


def explained(seed: int, sigma: float | None = None) -> tuple[SearchContext, Answer, tuple[ConsensusSet, ...]]:
    """Explain a scan of one of two equal rooms, each wall of which is drawn 5 cm off."""
    rooms = Segments.from_array(equal_rooms(2))
    errors = np.random.default_rng(seed).normal(0.0, 0.05, len(rooms))
    walls = rooms.endpoints + np.tile(errors[:, None] * rooms.normals, 2)
    context = context_of(index_of(walls, sigma), SCAN)
    found = search_and_rank(context)
    assert found.answer is not None
    return context, found.answer, tuple(found.alternatives)


def with_loose_walls(context: SearchContext, answer: Answer, rivals: tuple[ConsensusSet, ...]) -> float:
    found = probability_with_loose_walls(context, answer, rivals)
    assert found is not None
    return found


def test_a_twin_that_fits_worse_by_centimetres_is_a_twin() -> None:
    """By its costs one room stands out in most drawings; by what both miss by more than centimetres in few."""
    close, loose = [], []
    for seed in range(24):
        context, answer, rivals = explained(seed)
        close.append(probability_among(compare_alternatives(answer.best, rivals)) > 0.95)
        loose.append(with_loose_walls(context, answer, rivals) > 0.95)
    assert sum(close) > 0.7 * len(close)
    assert sum(loose) < 0.3 * len(close)


def test_that_the_answer_fits_well_shows_not_that_walls_are_where_they_are_drawn() -> None:
    """Of many similar places one always fits well, and seems to show that the map is exact."""
    context, answer, rivals = explained(0)
    well = replace(answer, estimated=replace(answer.estimated, wall_sigma=0.001))
    assert probability_among(compare_alternatives(answer.best, rivals)) > 0.95
    assert with_loose_walls(context, well, rivals) < 0.9
    ill = replace(answer, estimated=replace(answer.estimated, wall_sigma=0.1))
    assert with_loose_walls(context, ill, rivals) < with_loose_walls(context, well, rivals)


def test_alone_or_where_walls_are_known_to_be_there_is_no_second_look() -> None:
    context, answer, _ = explained(0)
    assert with_loose_walls(context, answer, ()) == 1.0
    assert probability_with_loose_walls(*explained(0, sigma=0.005)) is None


def test_after_the_deadline_there_is_no_second_look() -> None:
    context, answer, rivals = explained(0)
    late = replace(context, deadline=Deadline(time.monotonic() - 1.0))
    assert probability_with_loose_walls(late, answer, rivals) is None


def test_three_comparisons_count_by_their_geometric_mean() -> None:
    """By their weights. Places that are equal in all keep the same probability, whether two or three were made."""
    for one, mean, least in (
        (AmongAlternatives(0.9, 0.6, 0.3), 0.9**0.8 * 0.6**0.1 * 0.3**0.1, 0.3),
        (AmongAlternatives(0.9, 0.4, None), 0.9 ** (8.0 / 9.0) * 0.4 ** (1.0 / 9.0), 0.4),
        (AmongAlternatives(0.5, 0.5, 0.5), 0.5, 0.5),
        (AmongAlternatives(0.5, 0.5, None), 0.5, 0.5),
        (AmongAlternatives(1.0, 1.0, 1.0), 1.0, 1.0),
    ):
        assert (one.mean, one.least) == pytest.approx((mean, least))


def test_walls_that_are_declared_to_be_off_by_centimetres_have_a_second_look() -> None:
    """As those of a map of which nothing is known."""
    assert with_loose_walls(*explained(0, sigma=0.025)) < 1.0
    assert with_loose_walls(*explained(0)) < 1.0


def test_beams_within_the_error_of_the_walls_do_not_separate_rooms_but_a_thing_does() -> None:
    """Two rooms are equal; then one of them has a post."""
    rooms = np.vstack([ROOM, ROOM + np.tile([12.0, 0.0], 2)])
    post = np.array([[5.3, 2.5, 5.0, 2.8], [5.0, 2.8, 4.7, 2.5], [4.7, 2.5, 5.0, 2.2], [5.0, 2.2, 5.3, 2.5]])
    found = []
    for walls in (rooms, np.vstack([rooms, post])):
        index = index_of(walls)
        context = context_of(index, scan_of(seen(ROOM, INSIDE)[0], 0.02, (0.0, 0.0), beams_of(index, INSIDE)))
        explained = search_and_rank(context)
        assert explained.answer is not None
        found.append(with_loose_walls(context, explained.answer, tuple(explained.alternatives)))
    equal, with_post = found
    assert equal == pytest.approx(0.5, abs=0.05)
    assert with_post > 0.8


def test_what_a_prior_says_counts_whole() -> None:
    context, answer, rivals = explained(0)
    plain = with_loose_walls(context, answer, rivals)
    liked = replace(answer.best, posterior=answer.best.posterior + 1.0)
    by_prior = with_loose_walls(context, replace(answer, best=liked), rivals)
    odds = by_prior / (1.0 - by_prior) / (plain / (1.0 - plain))
    assert odds == pytest.approx(math.exp(1.0 / LOOSE_TEMPERATURE), rel=1e-6)


CUPBOARD = np.array([[4.6, 0.6, 4.6, 2.6], [4.6, 2.6, 7.2, 2.6], [7.2, 2.6, 7.2, 0.6], [7.2, 0.6, 4.6, 0.6]])
IN_SECOND = pose(INSIDE.x + 12.0, INSIDE.y, INSIDE.theta)


def one_cupboard(*, there: bool) -> AssociationResult:
    """Locate a scan of the second of two equal rooms, in which alone the map shows a cupboard."""
    thing = CUPBOARD + np.tile([12.0, 0.0], 2)
    rooms = equal_rooms(2)
    place = index_of(np.vstack([rooms, thing]))
    today = place if there else index_of(rooms)
    pieces = np.vstack([ROOM + np.tile([12.0, 0.0], 2), thing[[0, 1]] if there else np.empty((0, 4))])
    return answer_of(place, scan_of(seen(pieces, IN_SECOND)[0], 0.02, (0.0, 0.0), beams_of(today, IN_SECOND)))


def test_a_thing_that_was_moved_away_does_not_tell_two_rooms_apart() -> None:
    """The room that never had it fits without a fault; all that speaks for the right one is that it may be gone."""
    result = one_cupboard(there=False)
    assert not result.usable
    assert "similar_place" in [reason.code for reason in result.reasons]
    assert result.alternatives


def test_a_thing_that_is_where_the_map_shows_it_tells_two_rooms_apart() -> None:
    result = one_cupboard(there=True)
    assert result.usable
    assert result.pose is not None
    assert math.hypot(result.pose.x - IN_SECOND.x, result.pose.y - IN_SECOND.y) < 0.05


def test_what_the_scan_does_not_show_counts_up_to_a_limit() -> None:
    """Of two explanations with equal matches; any number of beams counts as one thing that may be gone."""
    context, answer, _ = explained(0)
    equal = replace(answer.best, score=answer.best.score - 40.0, posterior=answer.best.posterior - 40.0)
    limited = 1.0 / (1.0 + math.exp(-ABSENCE))
    assert probability_by_shown(context, answer.best, [equal]) == pytest.approx(limited)
    fewer = equal.matches.copy()
    fewer["score"][0] = 0.0
    gap = float(answer.best.matches["score"][0]) + ABSENCE
    expected = 1.0 / (1.0 + math.exp(-gap))
    assert probability_by_shown(context, answer.best, [replace(equal, matches=fewer)]) == pytest.approx(expected)
    assert probability_by_shown(context, answer.best, []) == 1.0


def test_a_prior_counts_in_full_next_to_what_the_scan_shows() -> None:
    context, answer, _ = explained(0)
    unlikely = replace(answer.best, posterior=answer.best.posterior - 30.0)
    assert probability_by_shown(context, answer.best, [unlikely]) > 0.999
