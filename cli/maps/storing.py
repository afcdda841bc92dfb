"""``linefix map put``, ``list``, ``get``, ``rm``: maps stored by id; and ``draw``: maps to files of other tools."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from ..asking import Where
from ..errors import WrongUseError
from ..inputs import MAP_ID, draw_picture, read_map_file, read_map_or_id
from ..options import MapArgument, argument, grouped, required
from ..printing import Json, Output, listing, outline, print_json, print_lines


def _checked(map_id: str) -> str:
    if not MAP_ID.fullmatch(map_id):
        raise WrongUseError(f"the id is not valid: expected 1 to 128 of A-Z a-z 0-9 . _ -, found {map_id[:200]!r}")
    return map_id


MapId = Annotated[str, argument("Id of the map: 1 to 128 of A-Z a-z 0-9 . _ -", "ID")]
MapFile = Annotated[str, argument("A map file: json, or another file that map import reads.", "FILE")]


@grouped
def put(map_id: MapId, file: MapFile, where: Where, output: Output) -> None:
    """Store a map under an id."""
    told = where.ask("put_map", _checked(map_id), read_map_file(file), names={"": file})
    output.print(told, outline(told))


@grouped
def list_maps(where: Where, output: Output) -> None:
    """List the stored maps, by id; with --json one a line."""
    maps, cursor = list[Json](), ""
    with where.opened() as service:
        while cursor is not None:
            page = service.ask("list_maps", cursor=cursor or None)
            maps, cursor = [*maps, *page["maps"]], page["next"]
    if output.as_json:
        for one in maps:
            print_json(one)
        return
    print_lines(listing(maps))


@grouped
def get(map_id: MapId, where: Where) -> None:
    """Print a stored map as JSON."""
    print_json(where.ask("get_map", _checked(map_id)))


@grouped
def remove(map_id: MapId, where: Where) -> None:
    """Forget a stored map."""
    where.ask("delete_map", _checked(map_id))


@grouped
def draw(on: MapArgument, out: Annotated[Path, required("File to write: png.", "FILE")], where: Where) -> None:
    """Draw a map: walls in grey, a blue tick on the free side of each."""
    draw_picture(where.whole_map(read_map_or_id(on)), out)
