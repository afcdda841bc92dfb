"""Faults of a request in words of the contract: what was expected, and the number that was found."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from linefix.documents.faults import faults_of
from linefix.documents.requests import AssociateRequest, VectorizeRequest

SCAN = {"segments": [[0.0, 0.0, 1.0, 0.0]]}


def asked(**parts: Any) -> dict[str, Any]:
    return {"map": {"map_id": "hq-3"}, "scan": SCAN, **parts}


@pytest.mark.parametrize(
    ("body", "fault"),
    [
        (asked(options={"confidence": 0.2}), "/options/confidence: expected at least 0.5"),
        (asked(options={"max_alternatives": 51}), "/options/max_alternatives: expected at most 50"),
        (asked(options={"sampling": "x"}), "/options/sampling: expected 'ordered' or 'random'"),
        (asked(options={"include": ["segments"] * 20}), "/options/include: expected at most 16 items, found 20"),
        (asked(scan={"views": []}), "/scan/views: expected at least 1 items, found 0"),
        (asked(map={"map_id": ""}), "/map/map_id: expected at least 1 characters"),
        (asked(map={"map_id": "a" * 200}), "/map/map_id: expected at most 128 characters"),
        (asked(map={"map_id": "a b"}), "/map/map_id: expected only letters (A to Z, a to z), digits and the"),
        (asked(scan={}), "/scan: expected exactly one of segments, laser, points and views"),
        (
            asked(prior={"x": 0.0, "y": 0.0, "theta": 0.0, "radius": 0.0, "angle": 1.0}),
            "/prior/radius: expected more than 0",
        ),
        (asked(client_ref="x" * 20_000), "/client_ref: expected at most 16384 bytes of JSON, found 20002 or more"),
    ],
)
def test_a_fault_says_what_was_expected(body: dict[str, Any], fault: str) -> None:
    with pytest.raises(ValidationError) as caught:
        AssociateRequest.model_validate(body)
    (found,) = faults_of(caught.value.errors())
    assert str(found).startswith(fault)


def test_a_choice_of_two_names_both() -> None:
    with pytest.raises(ValidationError) as caught:
        VectorizeRequest.model_validate({})
    assert "exactly one of laser and points" in str(faults_of(caught.value.errors())[0])
