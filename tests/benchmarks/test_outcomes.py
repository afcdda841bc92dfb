"""Searching collections: here, and on an engine."""

from __future__ import annotations

from dataclasses import replace

import pytest

from batch import Processes
from benchmarks import outcomes
from benchmarks.drawn import drawn_offices
from benchmarks.outcomes import Outcome, Piece, run


def answers(found: list[Outcome]) -> list[tuple[object, ...]]:
    return [(o.query.number, o.query.level, o.map, o.right, o.among, o.result.pose, o.result.status) for o in found]


@pytest.mark.long
def test_an_engine_answers_as_this_process_does(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outcomes, "PIECE", 7)
    offices = drawn_offices(4)
    assert answers(run(offices, engine=Processes(2))) == answers(run(offices))


def test_a_piece_has_the_maps_that_it_needs_and_no_more() -> None:
    offices = drawn_offices(30)
    whole = Piece(offices, tuple(query.map for query in offices.queries), steps=False)
    pieces = whole.pieces()
    assert [query for piece in pieces for query in piece.collection.queries] == list(offices.queries)
    assert all(set(piece.collection.maps) == set(piece.keys) for piece in pieces)
    assert replace(whole, keys=()).pieces() == []
