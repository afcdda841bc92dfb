"""Which map a scan lies on, and one block's scans to rows of poses."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import pyarrow as pa

import linefix
from formats.reading import DRAWINGS
from linefix import AssociationOptions, AssociationResult, Deadline
from registration import InputError

from .blocks import Block, Row, rows_of
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


@dataclass(frozen=True, slots=True)
class FleetOptions:
    """Options of a run.

    Attributes
    ----------
    search : AssociationOptions
        Directions count only where those of the map do, too.
    deadline_ms : float
        For each search; its answer is the best result until then.
    block : int
        Scans that a worker does at a time: the loss when one is killed, and the number held in memory.
    prepare : callable, optional
        Called once in each worker before it searches, such as to compile the kernels while no deadline runs.
    """

    search: AssociationOptions = field(default_factory=AssociationOptions)
    deadline_ms: float = 10_000.0
    block: int = 512
    prepare: Callable[[], None] | None = None


@dataclass(frozen=True, slots=True)
class BlockSearch:
    """Searches the scans of a block; called in the process of a worker."""

    maps: MapShelf
    options: FleetOptions

    def __call__(self, block: Block) -> pa.Table:
        """Return one row of `POSES` for each scan, in order."""
        _prepared(self.options.prepare)
        rows = [
            {"log": block.log, "index": row.index, "stamp": row.values.get("stamp"), **self._found(block, row)}
            for row in rows_of(block)
        ]
        return pa.Table.from_pylist(rows, schema=POSES)

    def _found(self, block: Block, row: Row) -> dict[str, Any]:
        """Return the result of one scan, whatever is wrong with it: no scan costs another its row."""
        name = self.maps.name(row.values.get("map_id"), block.log)
        try:
            index, scan, begun = self.maps.get(name), row.scan(), time.perf_counter()
            deadline = Deadline(time.monotonic() + 1e-3 * self.options.deadline_ms)
            result = linefix.locate(index, scan, options=self.options.search, deadline=deadline)
            return {"map_id": name, "search_ms": 1e3 * (time.perf_counter() - begun), **_answered(result)}
        except InputError as error:
            return {"map_id": name, "usable": False, "error": f"invalid: {error}"}
        except Exception as error:
            return {"map_id": name, "usable": False, "error": f"internal: {type(error).__name__}: {error}"}


@lru_cache
def _prepared(prepare: Callable[[], None] | None) -> None:
    """Prepare this process, once."""
    if prepare is not None:
        prepare()


def lost_row(block: Block) -> pa.Table:
    """Return the row of a block of one scan whose search ends every worker."""
    row = {"log": block.log, "index": block.start, "usable": False}
    return pa.Table.from_pylist([row | {"error": "worker_lost: its search ended each worker early"}], schema=POSES)


def _answered(result: AssociationResult) -> dict[str, Any]:
    found, covariance = result.diagnostics, result.covariance
    return {
        "status": str(result.status),
        "usable": result.usable,
        "probability": result.probability,
        **({} if result.pose is None else asdict(result.pose)),
        "covariance": None if covariance is None else covariance.ravel().tolist(),
        "unobservable": None if result.unobservable is None else [float(c) for c in result.unobservable],
        "reasons": [reason.code for reason in result.reasons],
        "warnings": [warning.code for warning in result.warnings],
        "inlier_fraction": None if found is None else found.inlier_fraction,
        "margin": None if found is None else found.margin,
        "complete": result.search.complete,
    }
