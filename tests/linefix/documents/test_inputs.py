"""The search gets the options of the request."""

from __future__ import annotations

from typing import Any

import pytest

from association import INCLUDED, AssociationOptions
from linefix.documents.inputs import association_options_of
from linefix.documents.parts import SearchOptions


@pytest.mark.parametrize(
    ("sent", "parts"),
    [({}, INCLUDED), ({"include": []}, ()), ({"include": ["segments", "alternatives"]}, ("alternatives",))],
)
def test_only_parts_that_are_included_are_worked_out(sent: dict[str, Any], parts: tuple[str, ...]) -> None:
    asked = SearchOptions.model_validate(sent, strict=False)
    assert association_options_of(asked, oriented=True).include == parts


def test_the_defaults_are_those_of_the_library() -> None:
    assert association_options_of(SearchOptions(), oriented=True) == AssociationOptions()


def test_what_decides_is_taken_over() -> None:
    asked = SearchOptions(on_map=0.7, usable_from=0.8)
    found = association_options_of(asked, oriented=True)
    assert (found.on_map, found.usable_from) == (0.7, 0.8)
