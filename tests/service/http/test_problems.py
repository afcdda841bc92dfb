"""The one table of problems."""

from __future__ import annotations

from http import HTTPStatus

import pytest

from association import CancelledError
from linefix.documents import errors as schemas
from linefix.documents.errors import BodyTooLargeError, Fault, InvalidRequestError
from service import errors
from service.http.problems import INTERNAL, KINDS, RAISED, TABLE, problem_of

TREES = (errors.ServiceError, errors.StoreError, schemas.RequestError)


def test_a_code_is_one_row_and_an_exception_in_one_row() -> None:
    assert len(KINDS) == len(TABLE)
    assert len(RAISED) == sum(len(kind.raised_as) for kind in TABLE)
    for kind in TABLE:
        assert 400 <= kind.status < 600
        assert HTTPStatus(kind.status).phrase
        assert kind.title


@pytest.mark.parametrize("tree", TREES)
def test_whatever_a_room_raises_is_in_the_table(tree: type[Exception]) -> None:
    assert tree.__subclasses__()
    for error in tree.__subclasses__():
        assert error in RAISED or error in TREES, error


def test_anything_else_is_a_defect_and_told_nothing_of() -> None:
    for error in (ValueError("secret"), ZeroDivisionError("secret"), errors.StoreError("secret")):
        assert problem_of(error) is None
    assert INTERNAL.kind.status == 500


HEADERS = [
    (errors.MissingKeyError(), {"www-authenticate": 'Bearer realm="linefix"'}),
    (errors.UnknownKeyError(), {}),
    *((error, {"retry-after": "1"}) for error in (errors.QueueFullError(), errors.ShareUsedError())),
    *((error, {"retry-after": "1"}) for error in (errors.NotReadyError("x"), errors.ReadOnlyStoreError())),
    (errors.TooMuchHeldError(), {"retry-after": "1", "connection": "close"}),
    (BodyTooLargeError(7), {"connection": "close"}),
    (errors.BodyTooSlowError(9.0), {"connection": "close"}),
    (errors.EncodingError(), {"accept-encoding": "gzip"}),
    (errors.MethodNotAllowedError(["GET", "PUT"]), {"allow": "GET, PUT"}),
    (errors.RevisionConflictError(3), {"etag": '"3"'}),
    (errors.RevisionConflictError(None), {}),
]


@pytest.mark.parametrize(("error", "expected"), HEADERS, ids=lambda value: type(value).__name__)
def test_headers_of_a_problem(error: Exception, expected: dict[str, str]) -> None:
    problem = problem_of(error)
    assert problem is not None
    answer = problem.response("id")
    headers = {name: value for name, value in answer.headers.items() if name != "content-length"}
    assert headers == {"content-type": "application/problem+json", **expected}
    assert (answer.status_code, problem.detail) == (RAISED[type(error)].status, str(error))


def test_places_are_named_and_bounded() -> None:
    faults = [Fault("/" + "p" * 500, "m" * 500)] * 30
    problem = problem_of(InvalidRequestError(faults))
    assert problem is not None
    document = problem.as_json("id", lambda pointer: "/q" + pointer.removeprefix("/p"))
    assert document["detail"] == f"/q{'p' * 118}: {'m' * 200} (and 19 more)"
    assert document["errors"] == [{"pointer": "/q" + "p" * 118, "message": "m" * 200}] * 20
    long = problem_of(errors.NotReadyError("x" * 1000))
    assert long is not None
    assert long.as_json("id")["detail"] == "x" * 400


def test_a_cancelled_request_is_told_why() -> None:
    problem = problem_of(CancelledError())
    assert problem is not None
    assert (problem.kind.code, problem.detail[:28]) == ("not_ready", "the service is shutting down")
