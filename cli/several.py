"""Several maps of a command: files, folders and ids of stored maps to the maps of one request."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from .asking import whole_map
from .errors import WrongUseError
from .inputs import FILES, read_map_or_id
from .printing import Json

IN_BAGS = "metadata.yaml"  # a file in the folder of each bag of ROS 2
MOST_NAME = 120  # letters of a name; the contract allows 128
NOT_IN_NAMES = re.compile(r"[^A-Za-z0-9._-]+")


def read_target(names: Sequence[str]) -> Json:
    """Return the part of a request that names its map, or its maps: ``{"map": ...}`` or ``{"maps": [...]}``.

    Parameters
    ----------
    names : sequence of str
        Each a map file, a folder of map files, or the id of a stored map. The map of a file is named after it.

    Raises
    ------
    WrongUseError
        When one of them is none of these, or a folder holds no map.
    RefusedError
        When a file is not taken.
    """
    named = _named(names)
    if len(named) == 1:
        return {"map": named[0][1]}
    return {"maps": [{**one, "map_id": name} if "segments" in one else one for name, one in named]}


def read_maps(names: Sequence[str]) -> dict[str, Json]:
    """Return the maps of this machine themselves, by name.

    Parameters
    ----------
    names : sequence of str
        As of `read_target`.

    Raises
    ------
    WrongUseError
        Likewise, and when a stored map is named twice.
    RefusedError
        When a file is not taken, or a stored map is gone.
    """
    maps: dict[str, Json] = {}
    for name, document in _named(names):
        if name in maps:
            raise WrongUseError(f"found the map {name} twice, expected each map once; omit one of them")
        maps[name] = _whole(document, None)
    return maps


def _named(names: Sequence[str]) -> list[tuple[str, Json]]:
    """Return the map of each file by the name of the file, and ids of stored maps."""
    named: list[tuple[str, Json]] = []
    for name in (name for one in names for name in _files_of(one)):
        document, taken = read_map_or_id(name), {one for one, _ in named}
        stored = document.get("map_id") if "segments" not in document else None
        named.append((stored or _name_of(name, taken), document))
    return named


def _files_of(name: str) -> list[str]:
    """Return the map files of a folder, by name; of anything else itself, also of the folder of a bag."""
    folder = Path(name)
    if not folder.is_dir() or (folder / IN_BAGS).is_file():
        return [name]
    found = sorted(str(file) for file in folder.iterdir() if file.suffix.lower() in FILES and file.is_file())
    if not found:
        raise WrongUseError(f"{name}: found no map file in this folder, expected one with a suffix such as .json")
    return found


def _name_of(name: str, taken: set[str]) -> str:
    """Return the name of a file's map: that of the file without its suffix, with a number where it is taken."""
    stem = NOT_IN_NAMES.sub("-", Path(name).stem)[:MOST_NAME] or "map"
    return next(one for one in (stem, *(f"{stem}-{number}" for number in range(2, 1000))) if one not in taken)


def documents_of(target: Json, server: str | None) -> dict[str, Json]:
    """Return the maps of a request by name, those that are stored, too; the name of a single one may be empty."""
    maps = target["maps"] if "maps" in target else [target["map"]]
    return {
        one.get("map_id", ""): {key: value for key, value in _whole(one, server).items() if key != "map_id"}
        for one in maps
    }


def _whole(one: Json, server: str | None) -> Json:
    return one if "segments" in one else whole_map(one, server)
