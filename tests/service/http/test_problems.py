"""The one table of problems."""

from __future__ import annotations

from http import HTTPStatus

import orjson
import pytest

from association import CancelledError
from linefix.documents import errors as schemas
from linefix.documents.errors import BodyTooLargeError, Fault, InvalidRequestError, TooManyError
from registration import InvalidArgumentError
from service.admission import errors as admission
from service.http import errors as http
from service.http.problems import INTERNAL, KINDS, RAISED, TABLE, problem_of
from service.maps import errors as maps
from service.parsing import errors as parsing

TREES = (admission.AdmissionError, http.HttpError, maps.StoreError, parsing.ParsingError, schemas.RequestError)


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
        assert error in RAISED, error


def test_anything_else_is_a_defect_and_told_nothing_of() -> None:
    for error in (ValueError("secret"), ZeroDivisionError("secret"), maps.StoreError("secret")):
        assert problem_of(error) is None
    assert INTERNAL.kind.status == 500


HEADERS = [
    (admission.MissingKeyError(), {"www-authenticate": 'Bearer realm="linefix"'}),
    (admission.UnknownKeyError(), {}),
    (admission.QueueFullError(), {"retry-after": "1"}),
    (admission.ShareUsedError(), {"retry-after": "1"}),
    (admission.TooMuchHeldError(), {"retry-after": "1", "connection": "close"}),
    (admission.NotReadyError("x"), {"retry-after": "1"}),
    (admission.DeadlinePassedError(), {}),
    (BodyTooLargeError(7), {"connection": "close"}),
    (TooManyError("/scans", 2, "scans"), {}),
    (http.BodyTooSlowError(9.0), {"connection": "close"}),
    (http.EncodingError(), {"accept-encoding": "gzip"}),
    (http.MethodNotAllowedError(["GET", "PUT"]), {"allow": "GET, PUT"}),
    (maps.RevisionConflictError(3), {"etag": '"3"'}),
    (maps.RevisionConflictError(None), {}),
    (maps.ReadOnlyStoreError(), {"retry-after": "1"}),
    (maps.StoreFullError(), {}),
]


@pytest.mark.parametrize(("error", "expected"), HEADERS, ids=lambda value: type(value).__name__)
def test_what_comes_with_a_problem(error: Exception, expected: dict[str, str]) -> None:
    problem = problem_of(error)
    assert problem is not None
    answer = problem.response("id")
    headers = {name: value for name, value in answer.headers.items() if name != "content-length"}
    assert headers == {"content-type": "application/problem+json", **expected}
    document = orjson.loads(bytes(answer.body))
    kind = RAISED[type(error)]
    errors = document.pop("errors", None)
    assert errors in (None, [{"pointer": "/scans", "message": "expected at most 2 scans, found more; see /v1/limits"}])
    assert document == {
        "type": f"urn:linefix:problem:{kind.code}",
        "title": kind.title,
        "status": kind.status,
        "detail": f"/scans: {error}" if errors else str(error),
        "code": kind.code,
        "request_id": "id",
    }
    assert answer.status_code == kind.status


def test_places_are_named_and_bounded() -> None:
    faults = [Fault("/" + "p" * 500, "m" * 500)] * 30
    problem = problem_of(InvalidRequestError(faults))
    assert problem is not None
    document = orjson.loads(bytes(problem.response("id").body))
    assert document["detail"] == f"/{'p' * 119}: {'m' * 200} (and 19 more)"
    assert document["errors"] == [{"pointer": "/" + "p" * 119, "message": "m" * 200}] * 20
    problem = problem_of(TooManyError("", 5, "values"))
    assert problem is not None
    assert "errors" not in problem.as_json("id")
    long = problem_of(admission.NotReadyError("x" * 1000))
    assert long is not None
    assert long.as_json("id")["detail"] == "x" * 400


def test_a_place_can_be_moved() -> None:
    problem = problem_of(InvalidRequestError([Fault("/scan/sigma", "wrong")]))
    assert problem is not None
    moved = problem.as_json("id", lambda pointer: "/scans/3" + pointer.removeprefix("/scan"))
    assert moved["errors"] == [{"pointer": "/scans/3/sigma", "message": "wrong"}]
    assert moved["detail"] == "/scans/3/sigma: wrong"


@pytest.mark.parametrize(
    ("index", "pointer"), [(None, "/scan/segments"), (0, "/scan/segments/0"), (7, "/scan/segments/7")]
)
def test_what_the_libraries_refuse_has_its_place(index: int | None, pointer: str) -> None:
    problem = problem_of(InvalidArgumentError("too short", argument="scan.segments", index=index))
    assert problem is not None
    assert (problem.kind.code, problem.faults) == ("invalid_request", (Fault(pointer, "too short"),))
    assert problem.as_json("id")["detail"] == f"{pointer}: too short"


def test_the_first_place_stands_in_the_detail() -> None:
    one, other = Fault("/scan/segments/3", "expected 4 numbers, found 3"), Fault("", "expected an object")
    for faults, detail in (
        ([one], "/scan/segments/3: expected 4 numbers, found 3"),
        ([one, other], "/scan/segments/3: expected 4 numbers, found 3 (and 1 more)"),
        ([other], "expected an object"),
    ):
        problem = problem_of(InvalidRequestError(faults))
        assert problem is not None
        assert problem.as_json("id")["detail"] == detail


def test_who_is_cancelled_is_told_why() -> None:
    problem = problem_of(CancelledError())
    assert problem is not None
    assert (problem.kind.code, problem.detail) == (
        "not_ready",
        "the service is shutting down; send the request to another instance, or again after its restart",
    )
