"""Answers as JSON documents."""

from __future__ import annotations

import json
from dataclasses import replace

import linefix
from association import AssociationDiagnostics, Corrections
from linefix.documents.found import AssociationDiagnosticsAnswer
from linefix.documents.results import Included, association_json

ROOM = [[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]]
SEEN = [[-1, 1, -1, -5], [-1, -5, 1, -5], [1, -5, 1, -3], [1, -3, 4, -3], [4, -3, 4, 1], [4, 1, -1, 1]]


def test_corrections_and_the_turn_rate_are_in_the_diagnostics() -> None:
    answer = linefix.locate(ROOM, SEEN)
    assert isinstance(answer.diagnostics, AssociationDiagnostics)
    for corrections, turn_rate in ((Corrections(1.01, -0.02, (0.001, -0.002, 0.003)), 0.5), (None, None)):
        diagnostics = replace(answer.diagnostics, corrections=corrections, turn_rate=turn_rate)
        found = association_json(replace(answer, diagnostics=diagnostics), Included(frozenset(), "map", "laser"))
        document = json.loads(json.dumps(found))["diagnostics"]
        told = {"scale": 1.01, "offset": -0.02, "strain": [0.001, -0.002, 0.003]}
        assert document["corrections"] == (None if corrections is None else told)
        assert document["turn_rate"] == turn_rate
        AssociationDiagnosticsAnswer.model_validate(document)


def test_the_message_is_that_of_http() -> None:
    answer = linefix.locate(ROOM, SEEN)
    document = association_json(answer, Included(frozenset(), "map", "laser"))
    assert answer.message == document["message"]
    assert answer.message.startswith("The robot is at this pose with a probability of ")
