"""Responses of the application to exceptions."""

from __future__ import annotations

import logging

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.responses import Response
from starlette.routing import Match

from linefix.documents.errors import InvalidRequestError
from linefix.documents.faults import faults_of

from .errors import BodyBrokenError, MethodNotAllowedError, NotFoundError, RefusedError
from .exchange import state_of
from .problems import INTERNAL, RAISED, problem_of
from .search_stage import HangUpError

logger = logging.getLogger("linefix")
CLIENT_CLOSED_REQUEST = 499  # not sent to a reader; used in the log and the counts


def handle_errors(app: FastAPI) -> None:
    """Have an application answer with problems."""
    for kind in (*RAISED, RequestValidationError, HTTPException):
        app.add_exception_handler(kind, _refuse)
    app.add_exception_handler(HangUpError, _nobody)
    app.add_exception_handler(ClientDisconnect, _refuse)


async def _refuse(request: Request, error: Exception) -> Response:
    state = state_of(request.scope)
    assert state is not None
    problem = problem_of(_own(request, error))
    if problem is None:
        logger.error("a defect", exc_info=error, extra={"request_id": state.request_id})
        problem = INTERNAL
    state.noted["code"] = problem.kind.code
    return problem.response(state.request_id)


def _own(request: Request, error: Exception) -> Exception:
    """Return an exception of ours for what FastAPI and Starlette refuse by themselves."""
    match error:
        case RequestValidationError():
            return InvalidRequestError(faults_of(error.errors()))
        case ClientDisconnect():  # while the body was received; from the server, malformed chunks look the same
            return BodyBrokenError()
        case HTTPException(status_code=404):
            return NotFoundError()
        case HTTPException(status_code=405):
            return MethodNotAllowedError(_methods_of(request))
        case HTTPException():
            return RefusedError()
    return error


def _methods_of(request: Request) -> list[str]:
    """Return the methods of the path; the framework names the methods of one route only."""
    matching = (route for route in request.app.routes if route.matches(request.scope)[0] is not Match.NONE)
    methods = {method for route in matching for method in getattr(route, "methods", ())}
    return sorted(methods | {"HEAD"} if "GET" in methods else methods)


async def _nobody(request: Request, error: Exception) -> Response:
    return Response(status_code=CLIENT_CLOSED_REQUEST)
