"""Entity tags of maps: a map's tag is its revision in quotes."""

from __future__ import annotations

import re
from collections.abc import Container

from starlette.requests import Request

from linefix.documents.errors import Fault, InvalidRequestError

from ..maps import EVERY_REVISION, Preconditions

_TAG = re.compile(r'(W/)?"([^"]*)"')
_REVISION = re.compile(r"[1-9][0-9]{0,17}")


def etag(revision: int) -> str:
    """Return the strong entity tag of a revision."""
    return f'"{revision}"'


def demands_of(request: Request) -> Preconditions:
    """Return what ``If-Match`` and ``If-None-Match`` of a writing request demand.

    Raises
    ------
    InvalidRequestError
        When one is not of the form of RFC 9110: taken for no demand it could cost a map.
    """
    match, none_match = _joined(request, "if-match"), _joined(request, "if-none-match")
    wrong = [
        Fault(f"/header/{name}", f'expected * or tags in quotes, such as "3", found {_found(value)}')
        for name, value in (("if-match", match), ("if-none-match", none_match))
        if value is not None and not _is_well_formed(value)
    ]
    if wrong:
        raise InvalidRequestError(wrong)
    # A weak tag never matches strongly: RFC 9110, 8.8.3.2.
    return Preconditions(_revisions(match, weak=False), _revisions(none_match, weak=True))


def is_unchanged(request: Request, revision: int) -> bool:
    """Return whether a reader has this revision already."""
    revisions = _revisions(_joined(request, "if-none-match"), weak=True)
    return revisions is not None and revision in revisions


def _joined(request: Request, name: str) -> str | None:
    values = request.headers.getlist(name)
    return ", ".join(values).strip() if values else None


def _is_well_formed(header: str) -> bool:
    rest, tags = _TAG.subn("", header)
    return header == "*" or (tags > 0 and not rest.strip(" \t,"))


def _found(header: str) -> str:
    """Return what an ill-formed header has, without a repetition of it."""
    return "text next to the tags" if _TAG.search(header) else "no tag in quotes"


def _revisions(header: str | None, *, weak: bool) -> Container[int] | None:
    """Return the revisions that a header names; None where there is no header."""
    if header is None:
        return None
    if header == "*":
        return EVERY_REVISION
    found = (tag for is_weak, tag in _TAG.findall(header) if weak or not is_weak)
    return frozenset(int(tag) for tag in found if _REVISION.fullmatch(tag))
