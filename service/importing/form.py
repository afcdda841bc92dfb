"""multipart/form-data to files and fields; read by python-multipart, which the extra ``[formats]`` brings."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import PurePosixPath, PureWindowsPath
from typing import TYPE_CHECKING

from python_multipart.exceptions import FormParserError
from python_multipart.multipart import MultipartParser, parse_options_header

from ..schemas.errors import Fault, InvalidRequestError

if TYPE_CHECKING:
    from python_multipart.multipart import MultipartCallbacks

MOST_PARTS = 64
MOST_FIELD_BYTES = 1000
MOST_NAME_BYTES = 200


@dataclass(slots=True)
class Form:
    """What was sent.

    Attributes
    ----------
    files : dict of str to bytearray
        By name, without folders; none has the name of another.
    fields : dict of str to list of str
    """

    files: dict[str, bytearray] = field(default_factory=dict)
    fields: dict[str, list[str]] = field(default_factory=dict)


def read_form(content: bytes, content_type: str) -> Form:
    """Take a form apart.

    Raises
    ------
    InvalidRequestError
        When it is none, or has too many parts or files of one name.
    """
    boundary = parse_options_header(content_type)[1].get(b"boundary")
    if not boundary:
        raise _refused("expected a boundary in Content-Type, found none")
    form, parts = Form(), _Parts()
    try:
        parser = MultipartParser(boundary, parts.callbacks())
        parser.write(content)
    except (FormParserError, ValueError):
        parts.whole = False
    if not parts.whole:
        raise _refused(f"is not multipart/form-data as Content-Type states, or has more than {MOST_PARTS} parts")
    for disposition, data in parts.found:
        _take(form, disposition, data)
    return form


class _Parts:
    """Collects the parts while they are parsed: the Content-Disposition and the content of each."""

    def __init__(self) -> None:
        self.found: list[tuple[bytes, bytearray]] = []
        self.whole = False
        self._name, self._value = bytearray(), bytearray()
        self._disposition, self._data = b"", bytearray()

    def callbacks(self) -> MultipartCallbacks:
        """Return what the parser calls."""
        return {
            "on_part_begin": self.part_begin,
            "on_part_data": self.part_data,
            "on_part_end": self.part_end,
            "on_header_field": self.header_field,
            "on_header_value": self.header_value,
            "on_header_end": self.header_end,
            "on_end": self.end,
        }

    def part_begin(self) -> None:
        """Begin a part."""
        if len(self.found) >= MOST_PARTS:
            raise ValueError("too many parts")
        self._disposition, self._data = b"", bytearray()

    def header_field(self, data: bytes, start: int, end: int) -> None:
        """Take up a piece of a header's name."""
        self._name += data[start:end]

    def header_value(self, data: bytes, start: int, end: int) -> None:
        """Take up a piece of a header's value."""
        self._value += data[start:end]

    def header_end(self) -> None:
        """Keep the one header that matters."""
        if self._name.lower() == b"content-disposition":
            self._disposition = bytes(self._value)
        self._name, self._value = bytearray(), bytearray()

    def part_data(self, data: bytes, start: int, end: int) -> None:
        """Take up a piece of the content."""
        self._data += memoryview(data)[start:end]

    def part_end(self) -> None:
        """Keep a part."""
        self.found.append((self._disposition, self._data))

    def end(self) -> None:
        """Note that the last boundary was there."""
        self.whole = True


def _take(form: Form, disposition: bytes, data: bytearray) -> None:
    told = {key: _decoded(value) for key, value in parse_options_header(disposition.decode("latin-1"))[1].items()}
    name = told.get(b"name", "")
    if b"filename" in told:
        own = _own_name(told[b"filename"])
        if own in form.files:
            raise InvalidRequestError([Fault("/files", "two files have the same name; rename one of them")])
        form.files[own] = data
        return
    if len(data) > MOST_FIELD_BYTES:
        raise InvalidRequestError(
            [Fault("", f"expected fields of at most {MOST_FIELD_BYTES} bytes, found {len(data)}")]
        )
    form.fields.setdefault(name, []).append(_decoded(bytes(data)))


def _own_name(name: str) -> str:
    """Return a file's name without folders, whichever system they are of."""
    own = PurePosixPath(PureWindowsPath(name).name).name
    if not own or own in (".", "..") or "\0" in own or len(own.encode()) > MOST_NAME_BYTES:
        raise InvalidRequestError(
            [Fault("/files", f"expected a file name of 1 to {MOST_NAME_BYTES} bytes; rename the file")]
        )
    return own


def _decoded(value: bytes) -> str:
    try:
        return value.decode("utf-8")
    except UnicodeDecodeError:
        raise _refused("has names or values that are not UTF-8; encode them in UTF-8") from None


def _refused(message: str) -> InvalidRequestError:
    return InvalidRequestError([Fault("", f"the body {message}" if message[0] in "ih" else message)])
