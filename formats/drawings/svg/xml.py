"""XML by the standard library, within bounds of depth, number and size."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from xml.etree.ElementTree import Element, ParseError, TreeBuilder
from xml.parsers import expat

from ...errors import FormatError, MalformedFileError, TooLargeError
from ...limits import MAX_DEPTH, MAX_ENTITIES, MAX_PATH_BYTES

NAMESPACE = "http://www.w3.org/2000/svg"
CHUNK = 64 * 2**10  # bytes that are parsed at a time
MAX_TOKEN_BYTES = 2 * MAX_PATH_BYTES  # of one tag with its attributes


class Node(Element):
    """An element that knows its line in the file."""

    line: int = 0


@dataclass(slots=True)
class Bounds:
    """Counts elements and the characters of their paths, and refuses too many."""

    count: int = 0
    path_bytes: int = 0

    def take(self, attributes: Mapping[str, str], depth: int) -> None:
        """Take an element, which is in so many others less one."""
        self.count += 1
        self.path_bytes += len(attributes.get("d", "")) + len(attributes.get("points", ""))
        if self.count > MAX_ENTITIES or depth > MAX_DEPTH:
            raise TooLargeError(
                f"expected at most {MAX_ENTITIES} elements, copies by use included, {MAX_DEPTH} in one another, found "
                f"{self.count}, {depth} in one another, or more"
            )
        if self.path_bytes > MAX_PATH_BYTES:
            raise TooLargeError(
                f"expected at most {MAX_PATH_BYTES} characters of paths, copies by use included, found "
                f"{self.path_bytes} or more; simplify the paths"
            )


class _Builder:
    """Builds the tree of elements, with the text of style elements alone."""

    def __init__(self) -> None:
        self.tree = TreeBuilder(element_factory=Node)
        self.parser = expat.ParserCreate(namespace_separator="}")
        self.bounds = Bounds()
        self.depth = 0
        self.in_style = False
        self.parser.StartElementHandler, self.parser.EndElementHandler = self.start, self.end
        self.parser.CharacterDataHandler = self.text
        self.parser.EntityDeclHandler = self.parser.AttlistDeclHandler = self.refuse

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self.depth += 1
        self.bounds.take(attributes, self.depth)
        node = self.tree.start("{" + tag if "}" in tag else tag, attributes)
        assert isinstance(node, Node)
        node.line = self.parser.CurrentLineNumber
        self.in_style = kind_of(node) == "style"

    def end(self, tag: str) -> None:
        self.depth -= 1
        self.in_style = False
        self.tree.end("{" + tag if "}" in tag else tag)

    def text(self, data: str) -> None:
        if self.in_style:
            self.tree.data(data)

    def refuse(self, *_declared: Any) -> None:
        raise MalformedFileError("declares XML entities, which are not read; save it as plain SVG")


def parse_xml(content: bytes) -> Element:
    """Parse XML without entities of its own, within bounds of depth and number.

    Raises
    ------
    MalformedFileError
        When it is no XML, has an encoding that is not known, or declares entities or attributes.
    TooLargeError
        When elements lie too deep, are too many, or one is too long.
    """
    builder = _Builder()
    try:
        for begin in range(0, len(content), CHUNK):
            builder.parser.Parse(content[begin : begin + CHUNK], False)
            size = begin - builder.parser.CurrentByteIndex
            if size > MAX_TOKEN_BYTES:
                raise TooLargeError(f"expected elements of at most {MAX_TOKEN_BYTES} bytes, found {size} or more")
        builder.parser.Parse(b"", True)
        return builder.tree.close()
    except FormatError:
        raise
    except LookupError as error:
        raise MalformedFileError("has an unknown encoding; save it in UTF-8") from error
    except (expat.ExpatError, ParseError, AssertionError, ValueError) as error:
        line = builder.parser.CurrentLineNumber
        raise MalformedFileError(f"is not XML from line {line} on; check whether the file is cut off") from error


def kind_of(element: Element) -> str:
    """Return the name of an element, without the namespace of SVG; those of other namespaces begin with a brace."""
    return str(element.tag).removeprefix("{" + NAMESPACE + "}")
