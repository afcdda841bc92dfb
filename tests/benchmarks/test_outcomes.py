"""Searching collections: here, and on an engine."""

from __future__ import annotations

from dataclasses import replace

from batch import Processes
from benchmarks.drawn import drawn_offices
from benchmarks.outcomes import PIECE, Outcome, Piece, run, strangers


def answers(outcomes: list[Outcome]) -> list[tuple[object, ...]]:
    return [(o.query.number, o.query.level, o.map, o.right, o.among, o.result.pose, o.result.status) for o in outcomes]


def test_an_engine_answers_as_this_process_does() -> None:
    offices = drawn_offices(30)
    assert len(offices.queries) > PIECE
    assert answers(run(offices, engine=Processes(2))) == answers(run(offices))
    assert answers(strangers(offices, Processes(2))) == answers(strangers(offices))


def test_a_piece_has_the_maps_that_it_needs_and_no_more() -> None:
    offices = drawn_offices(30)
    whole = Piece(offices, tuple(query.map for query in offices.queries), steps=False)
    pieces = whole.pieces()
    assert [query for piece in pieces for query in piece.collection.queries] == list(offices.queries)
    assert all(set(piece.collection.maps) == set(piece.keys) for piece in pieces)
    assert replace(whole, keys=()).pieces() == []
