"""Which map a scan lies on."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import linefix
from formats.reading import DRAWINGS

from .errors import UnreadableMapsError

SUFFIXES = (".yaml", ".yml", *DRAWINGS)
KEPT = 16  # indices that a worker holds; one of 20,000 segments takes some 10 MB


@dataclass(frozen=True, slots=True)
class MapShelf:
    """Maps by their ids, which are the names of their files without the ends.

    Attributes
    ----------
    files : mapping of str to str
        Paths by id.
    """

    files: Mapping[str, str]

    @classmethod
    def at(cls, path: str | os.PathLike[str]) -> MapShelf:
        """Return the one map of a file, or those of a folder.

        Raises
        ------
        UnreadableMapsError
            When there is none, or two have one id.
        """
        place = Path(path)
        found = sorted(place.iterdir()) if place.is_dir() else [place]
        files: dict[str, str] = {}
        for file in found:
            if file.suffix.lower() not in SUFFIXES or not file.is_file():
                continue
            if file.stem in files:
                raise UnreadableMapsError("has two maps of one name", argument=str(file.with_suffix("")))
            files[file.stem] = str(file)
        if not files:
            raise UnreadableMapsError(
                f"holds no map: expected a file that ends in one of {', '.join(sorted(SUFFIXES))}", argument=str(place)
            )
        shelf = cls(files)
        if len(files) == 1:
            read_index(next(iter(files.values())))  # an error in the only map spoils everything
        return shelf

    def name(self, told: str | None, log: str) -> str | None:
        """Return the id of a scan's map: its own value, the name of its log, or the only one."""
        if told is not None:
            return told
        stem = Path(log).stem
        if stem in self.files:
            return stem
        return next(iter(self.files)) if len(self.files) == 1 else None

    def get(self, name: str | None) -> linefix.MapIndex:
        """Return a map.

        Raises
        ------
        InputError
            When there is none of that name, or it cannot be searched.
        """
        path = None if name is None else self.files.get(name)
        if path is None:
            told = "nobody says which of the maps it lies on" if name is None else "there is no such map"
            raise UnreadableMapsError(told, argument=name or "map_id")
        return read_index(path)


@lru_cache(maxsize=KEPT)
def read_index(path: str) -> linefix.MapIndex:
    """Return the index of a map file.

    Raises
    ------
    InputError
        When it cannot be read or searched.
    """
    return linefix.index_map(linefix.read_map(path))
