"""Examples of the contract, from the file next to this; each is sent to the service by the tests.

``WALLS`` is a room, ``SEEN`` the same room as a sensor sees it that stands at (1, 0.5) and looks along the map's y
axis. ``RANGES`` are those of a scanner with 90 beams in the room, at (1, 0.5) and turned by 0.3 rad. The others are
requests.
"""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

_ALL: dict[str, Any] = json.loads(files(__package__).joinpath("examples.json").read_text())


def __getattr__(name: str) -> Any:
    """Return an example by its name in the file, in capitals."""
    try:
        return _ALL[name.lower()]
    except KeyError:
        raise AttributeError(name) from None
