"""From the bytes of a body to a checked request; light to import, since a process of its own does it for large ones."""

from __future__ import annotations

import re
import zlib
from dataclasses import dataclass
from typing import Any, TypeVar

import orjson
from pydantic import BaseModel, ValidationError

from ..http.problems import ProblemError, faults_of, invalid
from ..schemas.encoding import encode
from ..schemas.requests import BatchItem, BatchRequest, MapDocument
from ..schemas.strict import TooLargeError

M = TypeVar("M", bound=BaseModel)
Limits = dict[str, int]
_PIECE = 1 << 20
_NO_NUMBER = re.compile(r"-?(NaN|Inf)", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Body:
    """A body as it arrived."""

    data: bytes | bytearray
    gzipped: bool = False


def read_model(model: type[M], data: bytes | bytearray, limits: Limits) -> M:
    """Return a request from its JSON.

    Raises
    ------
    ProblemError
        When it is not JSON, or not what the model takes.
    TooLargeError
        When an array, or the whole, is longer than `limits` allow.
    """
    return validate(model, parse(data, limits), limits)


def read_batch(data: bytes | bytearray, limits: Limits) -> tuple[BatchRequest, list[BatchItem | Exception]]:
    """Return a batch without its scans, and each scan by itself: checked, or why it is none."""
    asked = read_model(BatchRequest, data, limits)
    items: list[BatchItem | Exception] = []
    for index, scan in enumerate(asked.scans):
        prior = None if asked.priors is None else asked.priors[index]
        try:
            items.append(validate(BatchItem, {"scan": scan, "prior": prior}, limits))
        except (ProblemError, TooLargeError) as error:
            items.append(error)
    return asked.model_copy(update={"scans": [], "priors": None}), items


def read_map(data: bytes | bytearray, limits: Limits) -> tuple[MapDocument, bytes]:
    """Return a map that is to be stored, and the document that is kept of it: what was sent and no more."""
    asked = read_model(MapDocument, data, limits)
    document = {name: getattr(asked, name) for name in ("segments", "sigma", "frame_id", "meta")}
    return asked, encode({name: value for name, value in document.items() if name in asked.model_fields_set})


def read_stored(document: bytes) -> MapDocument:
    """Return a map that was stored; what was checked then is not held to limits that may have changed since."""
    return MapDocument.model_validate(orjson.loads(document))


def unpack(body: Body, max_bytes: int) -> bytes | bytearray:
    """Return a body's bytes, at most as many as are allowed; takes a while for a large one.

    Raises
    ------
    ProblemError
        When it is not gzip though it says so, or unpacks to more than is allowed.
    """
    if not body.gzipped:
        return body.data
    unpacked = bytearray()
    stream = zlib.decompressobj(wbits=zlib.MAX_WBITS | 16)
    packed = memoryview(body.data)
    try:
        for begin in range(0, len(packed), _PIECE):
            rest: bytes | memoryview = packed[begin : begin + _PIECE]
            while rest and not stream.eof:
                unpacked += stream.decompress(rest, max_bytes + 1 - len(unpacked))
                rest = stream.unconsumed_tail
                if len(unpacked) > max_bytes:
                    raise too_large(max_bytes)
            if stream.eof and (stream.unused_data or begin + _PIECE < len(packed)):
                raise ProblemError("invalid_json", "something follows the gzip body")
        unpacked += stream.flush()
    except zlib.error:
        raise ProblemError("invalid_json", "the body is not gzip, though Content-Encoding says so") from None
    if not stream.eof:
        raise ProblemError("invalid_json", "the gzip body is cut short")
    return unpacked


def parse(data: bytes | bytearray, limits: Limits) -> Any:
    """Parse JSON; NaN, infinities, lone surrogates and nesting beyond 1,024 levels are not JSON here.

    Raises
    ------
    ProblemError
        When it is not JSON.
    TooLargeError
        When there are more values than allowed: each takes some hundred bytes of memory, however short it is.
    """
    if len(data) > limits["values"] and sum(map(data.count, b",:[{")) > limits["values"]:
        raise TooLargeError("", limits["values"], "values")
    try:
        return orjson.loads(data)
    except orjson.JSONDecodeError as error:
        # The message of the parser speaks of the kind of error and its place, not of the text.
        what = f"{error.msg} at line {error.lineno} column {error.colno}"
        if _NO_NUMBER.match(error.doc, error.pos):
            what += ": NaN and Infinity are not JSON; a range without a return is null"
        raise ProblemError("invalid_json", what) from None


def validate(model: type[M], value: Any, limits: Limits) -> M:
    """Check parsed JSON against a request model.

    Raises
    ------
    ProblemError
        When it is not what the model takes.
    TooLargeError
        When an array is longer than `limits` allow.
    """
    try:
        return model.model_validate(value, context=limits)
    except ValidationError as error:
        raise invalid(faults_of(error.errors(include_url=False, include_input=False))) from None


def too_large(max_bytes: int) -> ProblemError:
    """Return the problem of a body that is too long; its rest is of no use, so the connection ends with the answer."""
    return ProblemError("too_large", f"a body has at most {max_bytes} bytes, unpacked", headers={"Connection": "close"})
