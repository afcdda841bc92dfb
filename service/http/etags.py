"""Entity tags of maps: a map's tag is its revision in quotes."""

from __future__ import annotations

import re
from collections.abc import Container

from starlette.datastructures import Headers

from linefix.documents.errors import Fault, InvalidRequestError

from ..maps import EVERY_REVISION, Preconditions

_TAG = re.compile(r'(W/)?"([^"]*)"')
_REVISION = re.compile(r"[1-9][0-9]{0,17}")


def etag(revision: int) -> str:
    """Return the strong entity tag of a revision."""
    return f'"{revision}"'


def demands_of(headers: Headers) -> Preconditions:
    """Return what ``If-Match`` and ``If-None-Match`` of a request demand.

    Raises
    ------
    InvalidRequestError
        When one is not of the form of RFC 9110: taken for no demand it could cost a map.
    """
    # A weak tag never matches strongly: RFC 9110, 8.8.3.2.
    return Preconditions(_revisions(headers, "if-match", weak=False), _revisions(headers, "if-none-match", weak=True))


def _revisions(headers: Headers, name: str, *, weak: bool) -> Container[int] | None:
    """Return the revisions that a header names; None where there is no header."""
    if name not in headers:
        return None
    header = ", ".join(headers.getlist(name)).strip()
    if header == "*":
        return EVERY_REVISION
    if _TAG.sub("", header).strip(" \t,") or not _TAG.search(header):
        message = 'expected * or tags in quotes, such as "3", found other text'  # without a repetition of it
        raise InvalidRequestError([Fault(f"/header/{name}", message)])
    named = (tag for is_weak, tag in _TAG.findall(header) if weak or not is_weak)
    return frozenset(int(tag) for tag in named if _REVISION.fullmatch(tag))
