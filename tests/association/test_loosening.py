"""In a building that repeats itself centimetres tell nothing where its map is centimetres off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from association.context import SearchContext
from association.explain import Answer, explain
from association.features import twin_share
from association.loosening import loose_twin_share
from association.ranking import Ranked
from association.tuning import LOOSE_WALLS
from registration import Segments

from .scenes import INSIDE, ROOM, context_of, equal_rooms, index_of, scan_of, seen

SCAN = scan_of(seen(ROOM, INSIDE)[0], viewpoint=(0.0, 0.0))


def explained(seed: int, sigma: float | None = None) -> tuple[SearchContext, Answer, tuple[Ranked, ...]]:
    """Explain a scan of one of two equal rooms, of which each wall is drawn 5 cm off by itself."""
    rooms = Segments.from_array(equal_rooms(2))
    errors = np.random.default_rng(seed).normal(0.0, 0.05, len(rooms))
    walls = rooms.endpoints + np.tile(errors[:, None] * rooms.normals, 2)
    context = context_of(index_of(walls, sigma), SCAN)
    found = explain(context)
    assert found.answer is not None
    return context, found.answer, found.rivals


def test_a_twin_that_fits_worse_by_centimetres_is_a_twin() -> None:
    """By its costs one room stands out in most drawings; by what both miss by more than centimetres in few."""
    close, loose = [], []
    for seed in range(24):
        context, answer, rivals = explained(seed)
        if answer.settled.wall_sigma >= LOOSE_WALLS:
            close.append(twin_share(answer.best, rivals) > 0.95)
            loose.append(loose_twin_share(context, answer, rivals) > 0.95)
    assert len(close) > 20
    assert sum(close) > 0.7 * len(close)
    assert sum(loose) < 0.3 * len(close)


def test_where_walls_are_not_far_off_or_known_to_be_there_is_no_second_look() -> None:
    context, answer, rivals = explained(0)
    assert loose_twin_share(context, answer, ()) == 1.0
    near = replace(answer, settled=replace(answer.settled, wall_sigma=0.99 * LOOSE_WALLS))
    assert loose_twin_share(context, near, rivals) == 1.0
    assert loose_twin_share(*explained(0, sigma=0.05)) == 1.0
