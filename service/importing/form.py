"""multipart/form-data to files and fields, by python-multipart's `FormParser`, which the extra ``[formats]`` brings."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import PurePosixPath, PureWindowsPath
from typing import TYPE_CHECKING

from python_multipart import FormParser
from python_multipart.exceptions import FormParserError
from python_multipart.multipart import parse_options_header

from linefix.documents.errors import Fault, InvalidRequestError

if TYPE_CHECKING:
    from python_multipart.multipart import Field, File

FORM = "multipart/form-data"
MOST_PARTS = 64
MOST_FIELD_BYTES = 1000
MOST_NAME_BYTES = 200
IN_MEMORY = {"MAX_MEMORY_FILE_SIZE": math.inf}  # the whole form is in memory already


@dataclass(slots=True)
class Form:
    """A form.

    Attributes
    ----------
    files : dict of str to bytes
        By name, without folders; each name is unique.
    fields : dict of str to list of str
    """

    files: dict[str, bytes] = field(default_factory=dict)
    fields: dict[str, list[str]] = field(default_factory=dict)

    def add_file(self, part: File) -> None:
        """Add a part that has a filename."""
        self._require_room()
        name = _own_name(_decoded(part.file_name or b""))
        if name in self.files:
            raise InvalidRequestError([Fault("/files", "two files have the same name; rename one of them")])
        assert isinstance(part.file_object, BytesIO)
        self.files[name] = part.file_object.getvalue()

    def add_field(self, part: Field) -> None:
        """Add a part that has none."""
        self._require_room()
        value = part.value or b""
        if len(value) > MOST_FIELD_BYTES:
            raise _refused(f"expected fields of at most {MOST_FIELD_BYTES} bytes, found {len(value)}")
        self.fields.setdefault(_decoded(part.field_name or b""), []).append(_decoded(value))

    def _require_room(self) -> None:
        if len(self.files) + sum(map(len, self.fields.values())) >= MOST_PARTS:
            raise _refused(f"expected at most {MOST_PARTS} parts, found more; send fewer")


def read_form(content: bytes, content_type: str) -> Form:
    """Parse a form.

    Raises
    ------
    InvalidRequestError
        When it is none, or has too many parts or files of one name.
    """
    boundary = parse_options_header(content_type)[1].get(b"boundary")
    if not boundary:
        raise _refused("expected a boundary in Content-Type, found none")
    form, ends = Form(), list[bool]()
    try:
        parser = FormParser(FORM, form.add_field, form.add_file, lambda: ends.append(True), boundary, config=IN_MEMORY)
        parser.write(content)
    except FormParserError:
        ends.clear()
    if not ends:
        raise _refused("the body is not multipart/form-data as Content-Type states")
    return form


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
        raise _refused("the body has names or values that are not UTF-8; encode them in UTF-8") from None


def _refused(message: str) -> InvalidRequestError:
    return InvalidRequestError([Fault("", message)])
