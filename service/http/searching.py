"""A route that reads a request, searches and answers: what all of them have in common, around the work of each."""

from __future__ import annotations

import re
from collections.abc import Callable, Coroutine, Mapping
from functools import partial
from inspect import cleandoc
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Path, Response
from pydantic import BaseModel

from linefix.documents.reading import read_model

from .bodies import Reader, read
from .exchange import Exchange, Searching
from .openapi import takes

Work = Callable[[Exchange, Any], Coroutine[Any, Any, bytes]]
"""Answers a checked request with JSON."""
MapIdPath = Annotated[
    str, Path(pattern="^[A-Za-z0-9._-]+$", min_length=1, max_length=128, examples=["hq-3"], description="the map's id")
]
_TAG = re.compile("^/v1/([a-z]+)")


async def _of_map(map_id: MapIdPath) -> None:
    """Check the id in the path."""


def searching(
    router: APIRouter,
    path: str,
    model: type[BaseModel],
    answer: type[BaseModel],
    examples: Mapping[str, Any],
    reader: Reader[Any] | None = None,
) -> Callable[[Work], Work]:
    """Return a decorator that makes a route of the work on a request.

    Parameters
    ----------
    router : APIRouter
    path : str
    model, answer : type of BaseModel
        The request, and the answer; for the contract.
    examples : mapping
    reader : callable, optional
        Makes the request of JSON; left out: the model does.
    """
    read_request = reader or partial(read_model, model)

    def add(work: Work) -> Work:
        async def endpoint(exchange: Searching) -> Response:
            return await exchange.respond(work(exchange, await read(exchange, read_request)))

        router.add_api_route(
            path,
            endpoint,
            methods=["POST"],
            name=work.__name__,
            description=cleandoc(work.__doc__ or ""),
            response_model=answer,
            tags=_TAG.findall(path),
            dependencies=[Depends(_of_map)] if "{map_id}" in path else [],
            openapi_extra=takes(model, examples),
        )
        return work

    return add
