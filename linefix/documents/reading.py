"""From JSON to a checked request; light to import, since a process of its own does it for large bodies."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeVar

import orjson
from pydantic import BaseModel, ValidationError

from .encoding import encode
from .errors import Fault, InvalidRequestError, NotJsonError, RequestError, TooManyError
from .limits import MAX_FAULTS, Limits
from .parts import MapDocument
from .requests import BatchItem, BatchRequest
from .strict import nearest_name

M = TypeVar("M", bound=BaseModel)
_NO_NUMBER = re.compile(r"-?(NaN|Inf)", re.IGNORECASE)
_PLAIN = re.compile(r"^[A-Za-z0-9_.-]{1,40}$")
# pydantic's own messages for these types repeat the request, or use terms of Python.
_MESSAGES: dict[str, str] = {
    "extra_forbidden": "unknown field; correct its name or remove it",
    "missing": "expected this field, found none",
    "model_type": "expected an object",
    "model_attributes_type": "expected an object",
    "union_tag_invalid": "expected an object",
    "dict_type": "expected an object",
    "list_type": "expected an array",
    "float_type": "expected a number",
    "finite_number": "expected a number",
    "float_parsing": "expected a number",
    "int_type": "expected an integer",
    "int_from_float": "expected an integer",
    "int_parsing": "expected an integer",
    "bool_type": "expected true or false",
    "string_type": "expected a string",
    "literal_error": "expected {expected}",
    "greater_than_equal": "expected at least {ge}",
    "greater_than": "expected more than {gt}",
    "less_than_equal": "expected at most {le}",
    "less_than": "expected less than {lt}",
    "string_too_short": "expected at least {min_length} characters",
    "string_too_long": "expected at most {max_length} characters",
    "too_short": "expected at least {min_length} items, found {actual_length}",
    "too_long": "expected at most {max_length} items, found {actual_length}",
    # All patterns of the contract are those of ids.
    "string_pattern_mismatch": "expected only letters (A to Z, a to z), digits and the characters . _ -",
}


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


def validate(model: type[M], value: Any, limits: Limits | None = None) -> M:
    """Check parsed JSON against a request model.

    Raises
    ------
    InvalidRequestError
        When it is not what the model takes.
    TooManyError
        When an array is longer than `limits` allow; None: any length is taken.
    """
    try:
        return model.model_validate(value, context=limits)
    except ValidationError as error:
        raise InvalidRequestError(faults_of(error.errors(include_url=False, include_input=False))) from None


def faults_of(items: Iterable[Mapping[str, Any]]) -> list[Fault]:
    """Return the first places that pydantic complained of."""
    faults: list[Fault] = []
    for item in items:
        place = _pointer(item["loc"])
        rows = item.get("ctx", {}).get("rows")
        if rows is None:
            faults.append(Fault(place, _message(item)))
        else:
            faults.extend(Fault(f"{place}/{index}", message) for index, message in rows)
        if len(faults) >= MAX_FAULTS:
            break
    return faults[:MAX_FAULTS]


def _message(item: Mapping[str, Any]) -> str:
    message = _MESSAGES.get(item["type"])
    if message is None:
        return str(item["msg"])
    name = str(item["loc"][-1]) if item["type"] == "extra_forbidden" else ""
    known = nearest_name(name) if _PLAIN.match(name) else None
    return message.format_map(item.get("ctx", {})) + (f"; a similar name is {known}" if known else "")


def _pointer(parts: Sequence[object]) -> str:
    """Return a JSON pointer; a name that is not plain ends it, since it came from the caller."""
    pointer = ""
    for part in parts:
        name = str(part)
        if name.startswith("<"):
            continue  # of a union, the model that was chosen; or of the caller, which is not repeated
        if not _PLAIN.match(name):
            break
        pointer += f"/{name}"
    return pointer
