"""Several maps in one request."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Discriminator, Field, Tag
from pydantic_core import PydanticCustomError

from .errors import Fault, InvalidRequestError
from .parts import InlineMap, StoredMap
from .strict import MapId, Strict

FEWEST_MAPS, MOST_MAPS = 2, 256


class NamedMap(InlineMap):
    """A map in the request itself, with a name for the answer.

    Attributes
    ----------
    map_id
        name of the map in the answer
    """

    map_id: MapId


def _named_kind(value: Any) -> str:
    return "<named>" if isinstance(value, dict) and "segments" in value else "<stored>"


NamedOrStored = Annotated[
    Annotated[NamedMap, Tag("<named>")] | Annotated[StoredMap, Tag("<stored>")], Discriminator(_named_kind)
]


class MapPrefix(Strict):
    """All stored maps whose ids begin alike.

    Attributes
    ----------
    prefix
        beginning of the ids of the maps
    """

    prefix: Annotated[str, Field(pattern=r"^[A-Za-z0-9._-]{1,128}$", min_length=1, max_length=128)]


def _several_kind(value: Any) -> str:
    return "<prefix>" if isinstance(value, dict | MapPrefix) else "<list>"


SeveralMaps = Annotated[
    Annotated[Annotated[list[NamedOrStored], Field(min_length=FEWEST_MAPS, max_length=MOST_MAPS)], Tag("<list>")]
    | Annotated[MapPrefix, Tag("<prefix>")],
    Discriminator(_several_kind),
]


def _few_weights(value: Any) -> Any:
    """Refuse more weights than maps before any of them is looked at: each wrong one would become an error."""
    if isinstance(value, dict) and len(value) > MOST_MAPS:
        raise PydanticCustomError("weights", f"expected at most {MOST_MAPS} items, found {len(value)}")
    return value


MapWeights = Annotated[
    dict[MapId, Annotated[float, Field(ge=0.0, le=1.0)]],
    Field(min_length=1, max_length=MOST_MAPS),
    BeforeValidator(_few_weights),
]


def require_one_kind(map: object, maps: list[NamedMap | StoredMap] | MapPrefix | None, weights: object) -> None:
    """Refuse a request with both a map and several, or none, with weights of a single map, or with one map twice.

    Raises
    ------
    InvalidRequestError
        With the place of the fault.
    """
    if (map is None) == (maps is None):
        found = "neither" if map is None else "both"
        raise InvalidRequestError([Fault("", f"expected exactly one of map and maps, found {found}")])
    if maps is None and weights is not None:
        raise InvalidRequestError([Fault("/map_weights", "found it with a single map, expected it with maps; omit it")])
    if isinstance(maps, list):
        seen: dict[str, int] = {}
        for number, one in enumerate(maps):
            if seen.setdefault(one.map_id, number) != number:
                message = "found an id that another map has, expected a different one for each map"
                raise InvalidRequestError([Fault(f"/maps/{number}/map_id", message)])
