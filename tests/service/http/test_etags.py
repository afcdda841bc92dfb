"""Entity tags."""

from __future__ import annotations

import pytest
from starlette.requests import Request

from linefix.documents.errors import InvalidRequestError
from service.http.etags import demands_of, etag, is_conditional, is_unchanged
from service.maps import Preconditions


def request_of(*headers: tuple[str, str]) -> Request:
    return Request({"type": "http", "headers": [(name.encode(), value.encode()) for name, value in headers]})


def test_a_tag_is_the_revision_in_quotes() -> None:
    assert etag(17) == '"17"'


@pytest.mark.parametrize(
    ("headers", "demands"),
    [
        ([], Preconditions()),
        ([("if-match", '"3"')], Preconditions(if_match=frozenset([3]))),
        ([("if-match", '"3", "4",')], Preconditions(if_match=frozenset([3, 4]))),
        ([("if-match", '"3"'), ("if-match", '"4"')], Preconditions(if_match=frozenset([3, 4]))),
        ([("if-match", " * ")], Preconditions(any_match=True)),
        # A weak tag never matches strongly, and what is no number is no revision of ours: both match nothing.
        ([("if-match", 'W/"3"')], Preconditions(if_match=frozenset())),
        ([("if-match", '"x", "03", "0"')], Preconditions(if_match=frozenset())),
        ([("if-none-match", 'W/"3", "4"')], Preconditions(if_none_match=frozenset([3, 4]))),
        ([("if-none-match", "*")], Preconditions(none_may_exist=True)),
        (
            [("if-match", '"1"'), ("if-none-match", '"2"')],
            Preconditions(if_match=frozenset([1]), if_none_match=frozenset([2])),
        ),
    ],
)
def test_what_a_writer_demands(headers: list[tuple[str, str]], demands: Preconditions) -> None:
    assert demands_of(request_of(*headers)) == demands


@pytest.mark.parametrize("value", ["3", "", '"3', '"3" x', "**", "W/3", '"1", x'])
def test_what_is_no_tag_is_not_ignored(value: str) -> None:
    for name in ("if-match", "if-none-match"):
        with pytest.raises(InvalidRequestError) as caught:
            demands_of(request_of((name, value)))
        assert [fault.pointer for fault in caught.value.faults] == [f"/header/{name}"]
    with pytest.raises(InvalidRequestError) as caught:
        demands_of(request_of(("if-match", value), ("if-none-match", value)))
    assert len(caught.value.faults) == 2


@pytest.mark.parametrize(
    ("value", "unchanged"),
    [('"3"', True), ('W/"3"', True), ("*", True), ('"2", "3"', True), ('"2"', False), ("3", False)],
)
def test_whether_a_reader_has_it_already(value: str, unchanged: bool) -> None:
    request = request_of(("if-none-match", value))
    assert is_conditional(request)
    assert is_unchanged(request, 3) is unchanged
    assert not is_unchanged(request_of(("if-match", value)), 3)
    assert not is_conditional(request_of(("if-match", value)))
