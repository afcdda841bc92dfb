"""Uploaded files under names of our own, and where in the form something is wrong."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

from linefix.documents.errors import Fault, InvalidRequestError

from ..errors import FileTooLargeError, UnknownFormatError
from .fields import MapForm

if TYPE_CHECKING:
    from formats import FormatError

    from .form import Form

Lines = list[dict[str, Any]]
"""The answer of the bounded process: a report and the content, or an error."""

METADATA, BAG = "metadata.yaml", "bag"
PLAIN = re.compile(r"[A-Za-z0-9_][A-Za-z0-9 ._()+=@-]*")
PLAIN_NAMES = "expected a file name of letters, digits, spaces and ._()+=@- for a file of a bag; rename the file"
ENDING = re.compile(r"\.[a-z0-9]{1,8}")


@dataclass(frozen=True, slots=True)
class OwnFiles:
    """Uploaded files under names of our own: no path is made of an uploaded name.

    Attributes
    ----------
    map : Path
        Of the file that is read first, or the folder of a bag of ROS 2.
    paths : dict of str to Path
        By the names that were sent.
    """

    map: Path
    paths: dict[str, Path]

    def number_of(self, own: str) -> int | None:
        """Return which of the files has a name of our own; None where none has."""
        return next((k for k, path in enumerate(self.paths.values()) if path.name == own), None)

    def as_sent(self, own: str) -> str:
        """Return the name that was sent of what has a name of our own, fit to be printed; anything else as it is."""
        number = self.number_of(own)
        return own if number is None else "".join(c if c.isprintable() else "?" for c in list(self.paths)[number])


def own_files(names: list[str], map_name: str, folder: Path) -> OwnFiles:
    """Return where files are put that were sent; of their names an ending stays.

    A bag of several files names them in its metadata: these keep names that are letters, digits and a few signs.

    Raises
    ------
    InvalidRequestError
        When a file of such a bag has another name.
    """
    if map_name == METADATA:
        bag = folder / BAG
        bag.mkdir()
        for number, name in enumerate(names):
            if not PLAIN.fullmatch(name):
                raise InvalidRequestError([Fault(f"/files/{number}", PLAIN_NAMES)])
        return OwnFiles(bag, {name: bag / name for name in names})
    paths = {}
    for number, name in enumerate(names):
        ending = PurePosixPath(name).suffix.lower()
        paths[name] = folder / f"file-{number}{ending if ENDING.fullmatch(ending) else ''}"
    return OwnFiles(paths[map_name], paths)


def read_own(
    form: Form, folder: Path, read: Callable[[OwnFiles], Lines], suffixes: tuple[str, ...], kind: str, one: str
) -> Lines:
    """Put the files of a form into a folder and read them.

    The file that is read first ends in one of `suffixes`; `kind` names it in messages, and `one` what is expected.

    Raises
    ------
    InvalidRequestError
        When a file is wrong, or it is not clear which one is to be read.
    FileTooLargeError, UnknownFormatError
        When it is not read.
    """
    from formats import FormatError, TooLargeError, UnsupportedFormatError

    names = list(form.files)
    try:
        files = own_files(names, _first_read(names, suffixes, kind, one), folder)
        for name, data in form.files.items():
            files.paths[name].write_bytes(data)
        form.files.clear()
        return read(files)
    except TooLargeError as error:
        raise FileTooLargeError(error.message) from None
    except UnsupportedFormatError as error:
        raise UnknownFormatError(error.message) from None
    except FormatError as error:
        raise InvalidRequestError([fault_of(error, files)]) from None


def _first_read(names: list[str], suffixes: tuple[str, ...], kind: str, one: str) -> str:
    """Return which file is the map, or the log; the others are those that it names. Of a bag it is the metadata."""
    from formats import UnsupportedFormatError

    if METADATA in names:
        return METADATA
    found = [name for name in names if PurePosixPath(name).suffix.lower() in suffixes]
    if len(found) > 1:
        raise InvalidRequestError([Fault("/files", f"expected {one}; found {len(found)} {kind}s")])
    if not names:
        raise InvalidRequestError(
            [Fault("/files", "expected a file, found none; send a part of the form that has a filename")]
        )
    if not found:
        known = ", ".join(suffixes)
        raise UnsupportedFormatError(f"found no {kind}; expected a file that ends in one of {known}", argument="files")
    return found[0]


def fault_of(error: FormatError, files: OwnFiles) -> Fault:
    """Return the fault with its place in the form: a file by its number, since sent names are not repeated."""
    from formats import IncompleteFileError

    pointer, number = f"/{error.argument}", files.number_of(error.argument)
    if isinstance(error, IncompleteFileError) and number is None and pointer[1:] not in MapForm.fields:
        return Fault("/files", "the map names a file that was not sent, such as its picture; send it, too")
    if pointer[1:] not in MapForm.fields:
        pointer = "/files" if number is None else f"/files/{number}"
    elif error.index is not None:
        pointer += f"/{error.index}"
    return Fault(pointer, error.message)
