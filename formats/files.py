"""Files of other people, read whole within a bound."""

from __future__ import annotations

import os
from itertools import accumulate
from pathlib import Path
from typing import Any

import orjson
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode

from .errors import IncompleteFileError, MalformedFileError, TooLargeError, UnsupportedFormatError
from .limits import MAX_DEPTH, MAX_JSON_VALUES, MAX_YAML_VALUES
from .report import shown

BYTE_ORDER_MARK = b"\xef\xbb\xbf"  # that some editors put in front of UTF-8
MANY = 10**100  # YAML has integers that no float can hold
# Beginnings of files that have the ending of another format, or were never what they are called: what to do.
BEGINNINGS = {
    b"\x1f\x8b": "is compressed with gzip; unpack it first",
    b"\x28\xb5\x2f\xfd": "is compressed as a whole; decompress it first with zstd -d",
    b"PK\3\4": "is a ZIP archive, as of a spreadsheet; unpack it, or save the sheet as CSV",
    b"%PDF": "is a PDF; export the drawing as DXF or SVG",
    b"AC10": "is a DWG, which is not supported; save it as DXF",
    b"ISO-10303-21": "is a model in IFC or STEP; export the plan of a floor as DXF",
    b"version https://git-lfs": "is a pointer of Git LFS and not the file; run git lfs pull",
    **dict.fromkeys((b"<!DOCTYPE html", b"<html"), "is a web page, as of a login; download the file again"),
    **dict.fromkeys((b"# .PCD", b"ply\n"), "is a point cloud; expected lines or a grid"),
    **dict.fromkeys((b"II*\0", b"MM\0*"), "is a TIFF; save it as PNG"),
    b"GIF8": "is a GIF; save it as PNG",
    b"RIFF": "is a WebP; save it as PNG",
    b"#ROSBAG V2.0": "is a bag of ROS 1; its name has to end in .bag",
    b"\x89MCAP": "is an MCAP file; its name has to end in .mcap",
    b"\0\0\x27\x0a": "is a Shapefile; save it as GeoJSON, in UTM",
    b"SQLite format 3": "is a GeoPackage; save it as GeoJSON, in UTM; the name of a bag of ROS 2 has to end in .db3",
}
WIDE = (b"\xff\xfe", b"\xfe\xff")  # what UTF-16 begins with, as a redirection in PowerShell writes it


def name_of(path: Path) -> str:
    """Return what errors and reports call a file."""
    return shown(path.name)


def ending_of(path: Path) -> str:
    """Return what the ending of a name is, for errors."""
    return shown(path.suffix) if path.suffix else "a folder" if path.is_dir() else "no ending"


def kind_of(value: Any) -> str:
    """Return what a value of JSON or YAML is, for errors; of a number the number."""
    match value:
        case None:
            return "null"
        case bool():
            return "true or false"
        case int() if abs(value) >= MANY:
            return "a number that is too large"
        case int() | float():
            return f"{value:.6g}"
        case str():
            return "text"
        case list():
            return f"a list of {len(value)}"
        case dict():
            return "an object"
    return f"a {type(value).__name__}"


def require_content(path: Path, *, but: str = "") -> None:
    """Refuse a file that is missing, or begins as one of another format; `but` is a suffix of its own.

    Raises
    ------
    IncompleteFileError, UnsupportedFormatError
        With what to do.
    """
    if not path.exists():
        raise IncompleteFileError("there is no such file; check the path and the working folder")
    if path.is_file():
        with path.open("rb") as file:
            begin = file.read(max(map(len, BEGINNINGS)))
        what = next((what for other, what in BEGINNINGS.items() if begin.startswith(other)), "")
        if what and not (but and what.endswith(but)):
            raise UnsupportedFormatError(what)


def read_bounded(path: Path, limit: int) -> bytes:
    """Return what a file holds.

    Parameters
    ----------
    path : Path
    limit : int
        Bytes.

    Raises
    ------
    MalformedFileError
        When it cannot be read.
    TooLargeError
        When it is longer than the limit.
    """
    try:
        with path.open("rb") as file:
            content = file.read(limit + 1)
            size = max(len(content), os.fstat(file.fileno()).st_size)
    except OSError as error:
        raise MalformedFileError(f"cannot be read: {error.strerror}") from error
    if len(content) > limit:
        raise TooLargeError(f"expected at most {limit} bytes, found {size}; simplify the file, or divide it")
    return content


def text_of(content: bytes) -> str:
    """Decode UTF-8, with or without a byte-order mark.

    Raises
    ------
    MalformedFileError
        When it is something else.
    """
    if content.startswith(WIDE):
        raise MalformedFileError("is text in UTF-16; save it as UTF-8")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise MalformedFileError("expected text in UTF-8; save it as UTF-8") from error


def load_json(content: bytes) -> Any:
    """Parse JSON, with or without a byte-order mark.

    Raises
    ------
    MalformedFileError
        When it is none; orjson goes 1,024 levels deep at most.
    TooLargeError
        When it has so many values that they take much more memory than the file.
    """
    count = sum(content.count(sign) for sign in (b",", b"[", b"{"))
    if count > MAX_JSON_VALUES:
        raise TooLargeError(
            f"expected at most {MAX_JSON_VALUES} values, lists and objects, found {count}; divide the file"
        )
    try:
        return orjson.loads(text_of(content))
    except orjson.JSONDecodeError as error:
        raise MalformedFileError(
            f"is not JSON: line {error.lineno}, column {error.colno} cannot be read; export it again"
        ) from error


def load_yaml(text: str) -> object:
    """Return what a text in YAML holds.

    Aliases and merge keys let a few lines stand for any number of values; these are counted before any is built.

    Raises
    ------
    MalformedFileError
        When it is no YAML; the error names the line where it can.
    TooLargeError
        When it stands for too many values.
    """
    text = text.expandtabs()  # that people put behind a colon, which YAML does not allow
    depth = max(accumulate((sign in "[{") - (sign in "]}") for sign in text), default=0)
    if depth > MAX_DEPTH:  # the parser takes seconds to fail
        raise MalformedFileError(f"is not YAML of a map: expected at most {MAX_DEPTH} nested lists, found {depth}")
    try:
        root = YAML(typ="safe", pure=True).compose(text)
        if root is not None and _values(root, {}) > MAX_YAML_VALUES:
            raise TooLargeError(f"expected at most {MAX_YAML_VALUES} values, aliases counted each time")
        return YAML(typ="safe", pure=True).load(text)
    except (YAMLError, RecursionError, ValueError, TypeError, LookupError, AttributeError, ArithmeticError) as error:
        if isinstance(error, TooLargeError):
            raise
        where = ""
        if isinstance(error, MarkedYAMLError) and error.problem_mark is not None:
            problem = (error.problem or "it cannot be read").partition(" with value")[0]
            where = f": line {error.problem_mark.line + 1}: {shown(problem)}; correct it"
        raise MalformedFileError(f"is not YAML{where}") from error


def _values(node: Node, known: dict[int, int]) -> int:
    """Return the number of values that a node stands for; one that holds itself is refused as a recursion."""
    if isinstance(node, ScalarNode):
        return 1
    if id(node) not in known:
        known[id(node)] = MAX_YAML_VALUES + 1  # while it is counted: what holds itself has no end
        held = [one for pair in node.value for one in pair] if isinstance(node, MappingNode) else node.value
        known[id(node)] = 1 + sum(_values(one, known) for one in held)
    return known[id(node)]
