"""Several maps that are searched together: as they were found, and as they are cached."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from linefix.documents.parts import InlineMap

from .records import MapRecord

if TYPE_CHECKING:  # the store comes without what computes
    from association import MapSet


@dataclass(frozen=True, slots=True)
class FoundMaps:
    """Several maps that are to be searched, by name: those in the request, and the records of stored ones."""

    maps: tuple[tuple[str, InlineMap | MapRecord], ...]

    def reference_to(self, map_id: str) -> dict[str, object]:
        """Return id and revision of a map; the revision is None where the map came with the request."""
        one = dict(self.maps)[map_id]
        return {"map_id": map_id, "revision": one.revision if isinstance(one, MapRecord) else None}


@dataclass(frozen=True, slots=True)
class CachedMaps:
    """Several maps that are indexed together, with the frames that their poses are in."""

    maps: MapSet
    frame_ids: tuple[str, ...]
    bytes: int

    @property
    def oriented(self) -> bool:
        """Return whether directions of segments mean anything on all of the maps."""
        return self.maps.oriented

    def frame_of(self, map_id: str | None) -> str:
        """Return the frame of a map; of the first where there is none."""
        return self.frame_ids[0 if map_id is None else self.maps.ids.index(map_id)]
