"""Entity tags of maps: a map's tag is its revision in quotes."""

from __future__ import annotations

import re
from collections.abc import Container
from contextlib import suppress

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
    # A weak tag never matches strongly: RFC 9110, 8.8.3.2.
    return Preconditions(_revisions(request, "if-match", weak=False), _revisions(request, "if-none-match", weak=True))


def is_unchanged(request: Request, revision: int) -> bool:
    """Return whether a reader has this revision already; not by a header that is ill-formed."""
    with suppress(InvalidRequestError):
        return revision in (_revisions(request, "if-none-match", weak=True) or ())
    return False


def _revisions(request: Request, name: str, *, weak: bool) -> Container[int] | None:
    """Return the revisions that a header names; None where there is no header."""
    values = request.headers.getlist(name)
    if not values:
        return None
    header = ", ".join(values).strip()
    if header == "*":
        return EVERY_REVISION
    rest, tags = _TAG.subn("", header)
    if tags == 0 or rest.strip(" \t,"):
        found = "text next to the tags" if tags else "no tag in quotes"  # without a repetition of it
        message = f'expected * or tags in quotes, such as "3", found {found}'
        raise InvalidRequestError([Fault(f"/header/{name}", message)])
    named = (tag for is_weak, tag in _TAG.findall(header) if weak or not is_weak)
    return frozenset(int(tag) for tag in named if _REVISION.fullmatch(tag))
