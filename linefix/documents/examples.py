"""Examples of the contract, from the file next to this; each is sent to the service by the tests."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

Json = dict[str, Any]
_ALL: Json = json.loads(files(__package__).joinpath("examples.json").read_text())

WALLS: list[list[float]] = _ALL["walls"]
"""A room."""
SEEN: list[list[float]] = _ALL["seen"]
"""The same room as a sensor sees it that stands at (1, 0.5) and looks along the map's y axis."""
RANGES: list[float] = _ALL["ranges"]
"""Ranges of a scanner with 90 beams in the room, at (1, 0.5) and turned by 0.3 rad."""

REGISTER: Json = _ALL["register"]
ASSOCIATE: Json = _ALL["associate"]
ASSOCIATE_STORED: Json = _ALL["associate_stored"]
ASSOCIATE_SEVERAL: Json = _ALL["associate_several"]
BATCH: Json = _ALL["batch"]
CHECK: Json = _ALL["check"]
ANALYZE: Json = _ALL["analyze"]
ANALYZE_ROOM: Json = _ALL["analyze_room"]
UPDATE: Json = _ALL["update"]
APPLY: Json = _ALL["apply"]
VECTORIZE: Json = _ALL["vectorize"]
MAP: Json = _ALL["map"]
