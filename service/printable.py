"""JSON for terminals: what a file, a topic or a client said, without what a terminal would obey."""

from __future__ import annotations


def escaped(document: str) -> str:
    """Return a JSON document in one line with every character that is not printable as its escape.

    JSON escapes the control characters below 32 only; terminals obey those from 127 to 159 as well, and others change
    the direction of what follows.
    """
    if document.isascii() and "\x7f" not in document:
        return document
    return "".join(letter if letter.isprintable() else _escape(letter) for letter in document)


def _escape(letter: str) -> str:
    units = letter.encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{int.from_bytes(units[k : k + 2], 'big'):04x}" for k in range(0, len(units), 2))
