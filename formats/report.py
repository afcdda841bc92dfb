"""The report of an import, for people and programs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from .limits import MAX_NAMED, MAX_TEXT

FIRST_NAMES = 5


@dataclass(frozen=True, slots=True)
class Note:
    """One thing that an import did.

    Attributes
    ----------
    code : str
        For programs: stable, in lower case with underscores.
    message : str
        For people: one sentence.
    count : int
        Number of cells, entities, segments or messages; 0 if nothing is counted.
    """

    code: str
    message: str
    count: int = 0


@dataclass(frozen=True, slots=True)
class ImportReport:
    """The report of a file.

    Attributes
    ----------
    format : str
        Such as ``map_server``, ``dxf``, ``rosbag2``.
    files : tuple of str
        Names, without folders.
    read, merged, dropped, assumed : tuple of Note
        Content that was read; merged; dropped, with the reason; and assumptions.
    """

    format: str
    files: tuple[str, ...]
    read: tuple[Note, ...] = ()
    merged: tuple[Note, ...] = ()
    dropped: tuple[Note, ...] = ()
    assumed: tuple[Note, ...] = ()


@dataclass(slots=True)
class Notes:
    """Notes while they are taken; what has the same code is counted together."""

    read: dict[str, Note] = field(default_factory=dict)
    merged: dict[str, Note] = field(default_factory=dict)
    dropped: dict[str, Note] = field(default_factory=dict)
    assumed: dict[str, Note] = field(default_factory=dict)

    def add_read(self, code: str, message: str, count: int = 0) -> None:
        """Note what was taken."""
        _add(self.read, code, message, count)

    def add_merged(self, code: str, message: str, count: int) -> None:
        """Note what became one."""
        _add(self.merged, code, message, count)

    def add_dropped(self, code: str, message: str, count: int) -> None:
        """Note what was left out."""
        _add(self.dropped, code, message, count)

    def add_assumed(self, code: str, message: str, count: int = 0) -> None:
        """Note an assumption."""
        _add(self.assumed, code, message, count)

    def report(self, format: str, files: tuple[str, ...]) -> ImportReport:
        """Return what was noted so far."""
        kinds = (self.read, self.merged, self.dropped, self.assumed)
        return ImportReport(format, files, *(tuple(kind.values()) for kind in kinds))


def _add(kind: dict[str, Note], code: str, message: str, count: int) -> None:
    before = kind[code].count if code in kind else 0
    kind[code] = Note(code, message, before + count)


def shown(text: str) -> str:
    """Return text of a file so that it can stand in one line."""
    line = "".join(c if c.isprintable() else "?" for c in text[: MAX_TEXT + 1])
    return line if len(line) <= MAX_TEXT else line[:MAX_TEXT] + "..."


def first_of(names: Sequence[str]) -> str:
    """Return the first `FIRST_NAMES` names in one line, and how many more there are."""
    more = f" and {len(names) - FIRST_NAMES} more" if len(names) > FIRST_NAMES else ""
    return ", ".join(map(shown, names[:FIRST_NAMES])) + more


def listed(names: Iterable[str]) -> str:
    """Return names of a file in one line, the first few of many."""
    every = list(dict.fromkeys(names))
    return ", ".join(map(shown, every[:MAX_NAMED])) + (" ..." if len(every) > MAX_NAMED else "")


def listed_counts(counts: Counter[str]) -> str:
    """Return names of a file with their counts in one line, the most frequent first, the first few of many.

    A single name is without its count, which its note has.
    """
    if len(counts) == 1:
        return shown(next(iter(counts)))
    return listed(f"{shown(name)} ({count})" for name, count in counts.most_common())
