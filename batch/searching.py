"""Which map a scan lies on, and one block's scans to rows of poses."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path

import pyarrow as pa

from compiled import is_complete
from formats import read_map
from formats.reading import DRAWINGS
from linefix.answering import LocalService
from linefix.documents.errors import RequestError
from linefix.documents.results import map_json
from registration import InputError

from .blocks import Block, Json, rows_of, scan_document
from .errors import UnreadableMapsError
from .tables import POSES

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
        return cls(files)

    def name(self, told: str | None, log: str) -> str | None:
        """Return the id of a scan's map: its own value, the name of its log, or the only one."""
        if told is not None:
            return told
        stem = Path(log).stem
        if stem in self.files:
            return stem
        return next(iter(self.files)) if len(self.files) == 1 else None

    def path(self, name: str | None) -> str:
        """Return the file of a map; raises `UnreadableMapsError` where there is none of that name."""
        path = None if name is None else self.files.get(name)
        if path is None:
            told = "nobody says which of the maps it lies on" if name is None else "there is no such map"
            raise UnreadableMapsError(told, argument=name or "map_id")
        return path


@dataclass(frozen=True, slots=True)
class FleetOptions:
    """Options of a run.

    Attributes
    ----------
    on_map, usable_from, deadline_ms
        Of each search, as in a request; the answer is the best result until the deadline.
    block : int
        Scans that a worker does at a time: the loss when one is killed, and the number held in memory.
    """

    on_map: float = 0.9
    usable_from: float = 0.95
    deadline_ms: float = 10_000.0
    block: int = 512


@lru_cache(maxsize=KEPT)
def searching_on(path: str, options: FleetOptions) -> Callable[[Json], Json]:
    """Index the map of a file; return the function from the ``scan`` of a request to its answer.

    The kernels are compiled first: no deadline of a search is meant for that.

    Raises
    ------
    InputError, RequestError
        When it cannot be read or searched.
    """
    if not is_complete():
        from linefix.compiling import compile_kernels

        compile_kernels()
    search = {name: value for name, value in asdict(options).items() if name != "block"}
    document = map_json(read_map(path).map)
    return LocalService().locating({"map": document}, {**search, "max_alternatives": 0, "include": []})


@dataclass(frozen=True, slots=True)
class BlockSearch:
    """Searches the scans of a block; called in the process of a worker."""

    maps: MapShelf
    options: FleetOptions

    def __call__(self, block: Block) -> pa.Table:
        """Return one row of `POSES` for each scan, in order."""
        rows = [
            {**self._found(block, row), "log": block.log, "index": index, "stamp": row.get("stamp")}
            for index, row in enumerate(rows_of(block), block.start)
        ]
        return pa.Table.from_pylist(rows, schema=POSES)

    def _found(self, block: Block, row: Json) -> Json:
        """Return the result of one scan, whatever is wrong with it: no scan costs another its row."""
        name = self.maps.name(row.get("map_id"), block.log)
        try:
            search = searching_on(self.maps.path(name), self.options)
            return {**_columns_of(search({"scan": scan_document(row)})), "map_id": name}
        except (InputError, RequestError) as error:
            return {"map_id": name, "usable": False, "error": f"invalid: {error}"}
        except Exception as error:
            return {"map_id": name, "usable": False, "error": f"internal: {type(error).__name__}: {error}"}


def lost_row(block: Block) -> pa.Table:
    """Return the row of a block of one scan whose search ends every worker."""
    row = {"log": block.log, "index": block.start, "usable": False}
    return pa.Table.from_pylist([row | {"error": "worker_lost: its search ended each worker early"}], schema=POSES)


def _columns_of(answer: Json) -> Json:
    """Return an answer with its parts by the names of columns; other fields are no columns."""
    flat = {**answer, **(answer["pose"] or {}), **(answer["diagnostics"] or {}), **answer["search"]}
    codes = {name: [one["code"] for one in answer[name]] for name in ("reasons", "warnings")}
    covariance = answer["covariance"] and [number for row in answer["covariance"] for number in row]
    return {**flat, **codes, "covariance": covariance, "search_ms": answer["timing_ms"]["search"]}
