"""Lines of sight at the answer, where the scan was taken from one place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from association.consensus.sight import BeamFractions, agreement, compare_beams, missing_segments
from association.consensus.tuning import NEUTRAL
from association.rank_and_estimate import search_and_rank

from ..answers import SCAN, room
from ..reference import acceptance as missing_twin
from ..reference import agreement as agreement_twin
from ..scenes import INSIDE, ROOM, context_of, index_of, scan_of, seen

SCREENED = np.vstack([ROOM, [[4.5, 0.5, 4.5, 3.5]]])  # by a wall that is not seen
ENDPOINTS = seen(ROOM, INSIDE)[0]


@pytest.mark.parametrize("oriented", [True, False])
def test_what_should_have_been_seen_is_missing(oriented: bool) -> None:
    """By the index that was sent, once; without a viewpoint nothing is."""
    context = context_of(index_of(SCREENED), SCAN, oriented=oriented)
    best = search_and_rank(context).ranked[0]
    assert missing_segments(context, best) == (8,)
    rows, walls = context.lines.rows, context.index.walls.rows
    expected = missing_twin.missing_pieces(
        rows, best.matches["wall"], (0.0, 0.0), best.pose, walls, context.index.pieces
    )
    assert expected == ([8] if oriented else [17]), "the same wall, the other way round"
    nowhere = context_of(index_of(SCREENED), scan_of(ENDPOINTS), oriented=oriented)
    assert missing_segments(nowhere, search_and_rank(nowhere).ranked[0]) == ()


def test_agreement_is_that_of_the_pose() -> None:
    context = context_of(index_of(SCREENED), SCAN)
    best = search_and_rank(context).ranked[0]
    expected = agreement_twin.agreement(context.lines.rows, (0.0, 0.0), best.pose, context.index.walls.rows)
    assert agreement(context, best) == pytest.approx(expected)
    assert 0.5 < expected < 0.95
    elsewhere = context_of(index_of(SCREENED), scan_of(ENDPOINTS))
    assert agreement(elsewhere, best) == NEUTRAL


def test_beams_are_compared_at_the_settled_pose() -> None:
    """All read what the map shows; a wall more is in the way of some. Segments alone have no beams."""
    context = room(with_beams=True)
    explained = search_and_rank(context).answer
    assert explained is not None
    assert explained.beams == compare_beams(context, explained.estimated) == BeamFractions(0.0, 0.0)
    screened = replace(context, index=index_of(SCREENED))
    passed = compare_beams(screened, explained.estimated).farther
    assert 0.05 < passed < 0.5
    assert compare_beams(room(), explained.estimated) == BeamFractions()
