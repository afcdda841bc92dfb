"""The search gets the options of the request."""

from __future__ import annotations

from association import INCLUDED, AssociationOptions
from linefix.documents.inputs import association_options_of
from linefix.documents.parts import SearchOptions


def test_only_parts_that_are_included_are_worked_out() -> None:
    """By default all, as the library does; so are other options."""
    assert association_options_of(SearchOptions(), oriented=True) == AssociationOptions(include=INCLUDED)
    for names, parts in (([], ()), (["segments", "alternatives"], ("alternatives",))):
        asked = SearchOptions.model_validate({"include": names}, strict=False)
        assert association_options_of(asked, oriented=True).include == parts
