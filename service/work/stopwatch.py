"""How long the parts of a request took."""

from __future__ import annotations

import time

from association import Deadline


class Stopwatch:
    """Milliseconds since the request's body had arrived, in parts."""

    def __init__(self) -> None:
        self._begun = time.monotonic()
        self._last = self._begun
        self._parts: dict[str, float] = {}

    def lap(self, name: str) -> None:
        """Note the milliseconds since the last lap under a name."""
        now = time.monotonic()
        self._parts[name] = round(1e3 * (now - self._last), 3)
        self._last = now

    def timing_ms(self) -> dict[str, float]:
        """Return the parts and the total so far."""
        return {**self._parts, "total": round(1e3 * (time.monotonic() - self._begun), 3)}

    def deadline(self, asked_ms: float | None, most_ms: float) -> Deadline:
        """Return when to end: so many milliseconds after the body had arrived, waiting for a turn included."""
        allowed = most_ms if asked_ms is None else min(asked_ms, most_ms)
        return Deadline(at=self._begun + allowed / 1e3)
