"""Keys with roles, for the tests that need them."""

from __future__ import annotations

import hashlib
import json


def key_lines(key: str, roles: list[str], maps: str = "") -> str:
    """Return the lines of a file of keys."""
    digest = hashlib.sha256(key.encode()).hexdigest()
    prefix = f'maps = "{maps}"\n' if maps else ""
    return f'[[key]]\nname = "{key[:8]}"\nsha256 = "{digest}"\nroles = {json.dumps(roles)}\n{prefix}'
