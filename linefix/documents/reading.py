"""From JSON to a checked request; light to import, since a process of its own does it for large bodies."""

from __future__ import annotations

import re
from typing import Any, TypeVar

import orjson
from pydantic import BaseModel, ValidationError

from .encoding import encode
from .errors import InvalidRequestError, NotJsonError, RequestError, TooManyError
from .faults import faults_of
from .limits import Limits
from .parts import MapDocument
from .requests import BatchItem, BatchRequest

M = TypeVar("M", bound=BaseModel)
_NO_NUMBER = re.compile(r"-?(NaN|Inf)", re.IGNORECASE)


def read_model(model: type[M], data: bytes | bytearray, limits: Limits) -> M:
    """Return a request from its JSON.

    Raises
    ------
    NotJsonError
        When it is not JSON.
    InvalidRequestError
        When it is not what the model takes.
    TooManyError
        When an array, or the whole, is longer than `limits` allow.
    """
    return validate(model, parse(data, limits), limits)


def read_batch(data: bytes | bytearray, limits: Limits) -> tuple[BatchRequest, list[BatchItem | RequestError]]:
    """Return a batch without its scans, and each scan separately: checked, or the error that rejects it."""
    asked = read_model(BatchRequest, data, limits)
    items: list[BatchItem | RequestError] = []
    for index, scan in enumerate(asked.scans):
        prior = None if asked.priors is None else asked.priors[index]
        try:
            items.append(validate(BatchItem, {"scan": scan, "prior": prior}, limits))
        except RequestError as error:
            items.append(error)
    return asked.model_copy(update={"scans": [], "priors": None}), items


def read_map(data: bytes | bytearray, limits: Limits) -> tuple[MapDocument, bytes]:
    """Return a map that is to be stored, and the document to store: the sent fields and no more."""
    asked = read_model(MapDocument, data, limits)
    sent = [name for name in MapDocument.model_fields if name in asked.model_fields_set]
    return asked, encode({name: getattr(asked, name) for name in sent})


def read_stored(document: bytes) -> MapDocument:
    """Return a map that was stored; it is not held to limits that may have changed since then."""
    return MapDocument.model_validate(orjson.loads(document))


def parse(data: bytes | bytearray, limits: Limits) -> Any:
    """Parse JSON; NaN, infinities, lone surrogates and nesting beyond 1,024 levels are not JSON here.

    Raises
    ------
    NotJsonError
        When it is not JSON.
    TooManyError
        When there are more values than allowed: each takes some hundred bytes of memory, however short it is.
    """
    # Every value but the first follows one of these. Commas in strings count, too, which is cheap and on the safe side.
    if len(data) > limits.values and sum(map(data.count, b",:[{")) > limits.values:
        raise TooManyError("", limits.values, "values")
    try:
        return orjson.loads(data)
    except orjson.JSONDecodeError as error:
        # The parser's message names the kind of error and its place, and repeats nothing of the text.
        what = f"{error.msg} at line {error.lineno} column {error.colno}"
        if _NO_NUMBER.match(error.doc, error.pos):
            what += ": NaN and Infinity are not JSON; an unknown range is null, no return a number above range_max"
        raise NotJsonError(what) from None


def validate(model: type[M], value: Any, limits: Limits) -> M:
    """Check parsed JSON against a request model.

    Raises
    ------
    InvalidRequestError
        When it is not what the model takes.
    TooManyError
        When an array is longer than `limits` allow.
    """
    try:
        return model.model_validate(value, context=limits)
    except ValidationError as error:
        raise InvalidRequestError(faults_of(error.errors(include_url=False, include_input=False))) from None
