"""The floor of a drawing that has several."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...errors import IncompleteFileError, InvalidOptionError
from ...report import listed_counts
from ..drawing import Drawing, Polyline
from ..selection import matches

STOREY = 2.0  # m; heights that are less apart belong to one floor
FLAT = 0.5  # m; a polyline that rises by more is on no floor
SAME = 0.01  # m; ends of lines that are drawn on two floors alike


def on_level(drawing: Drawing, metres: float) -> list[Polyline]:
    """Return the polylines of the floor that the option level chooses; all where the drawing has one floor.

    Floors that are drawn alike, such as the upper and the lower edges of walls, count as one.

    Raises
    ------
    IncompleteFileError
        When there are several floors, and none is chosen.
    InvalidOptionError
        When there is no such floor.
    """
    lines, wanted = drawing.polylines, drawing.options.level
    if not any(one.levels for one in lines):
        lines = _by_height(lines, metres)
    counts: Counter[str] = Counter()
    for one in lines:
        counts.update(dict.fromkeys(one.levels, len(one.ends)))
    chosen = [name for name in counts if wanted is not None and matches((name,), (wanted,))]
    if wanted is not None and not chosen:
        there = f"one of the levels of the file, with lines: {listed_counts(counts)}" if counts else "none"
        why = "" if counts else ", because the file names no levels"
        raise InvalidOptionError(f"expected {there}{why}, found another name", argument="level")
    if not chosen:
        if len(counts) > 1 and _differ(lines, counts, metres, named=any(one.levels for one in drawing.polylines)):
            raise IncompleteFileError(
                f"has {len(counts)} levels, with lines: {listed_counts(counts)}; choose one with the option level "
                f"(--level '{next(iter(counts))}'; '*' is all)"
            )
        loose = sum(len(one.ends) for one in lines if not one.levels)
        if len(counts) == 1 and loose and any(one.levels for one in drawing.polylines):
            said = (
                f"lines without a level are used with those of level {next(iter(counts))}; the option level omits them"
            )
            drawing.notes.add_assumed("no_level", said, loose)
        return lines
    others = Counter[str]()
    for one in lines:
        if not set(chosen) & set(one.levels):
            others["/".join(one.levels) or "no level"] += len(one.ends)
    if others:
        drawing.notes.add_dropped(
            "other_level", f"lines that are not on level {', '.join(chosen)}: {listed_counts(others)}", others.total()
        )
    drawing.meta |= {"level": ", ".join(chosen)}
    return [one for one in lines if set(chosen) & set(one.levels)]


def _by_height(lines: list[Polyline], metres: float) -> list[Polyline]:
    """Name the floors of flat polylines by their least height."""
    flat = [metres * (one.heights[1] - one.heights[0]) <= FLAT for one in lines]
    heights = np.array([metres * one.heights[0] for one in lines])
    sorted_heights = np.unique(heights[flat])
    firsts = sorted_heights[np.diff(sorted_heights, prepend=-np.inf) >= STOREY]
    if len(firsts) < 2:
        return lines
    floors = np.searchsorted(firsts, heights, side="right") - 1
    return [
        replace(one, levels=(f"{firsts[floor]:g}",)) if is_flat else one
        for one, floor, is_flat in zip(lines, floors, flat, strict=True)
    ]


def _differ(lines: list[Polyline], names: Iterable[str], metres: float, *, named: bool) -> bool:
    """Tell whether floors are drawn unlike; those of heights may be a part of another."""
    drawn = [
        {tuple(row) for one in lines if name in one.levels for row in undirected(one.ends * (metres / SAME)).tolist()}
        for name in names
    ]
    most = max(drawn, key=len)
    return any(one != most if named else not one <= most for one in drawn)


def undirected(lines: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return lines rounded to whole numbers, (n, 4), each from its lesser end to its greater."""
    keys = np.rint(lines)
    backward = (keys[:, 0] > keys[:, 2]) | ((keys[:, 0] == keys[:, 2]) & (keys[:, 1] > keys[:, 3]))
    return np.where(backward[:, None], keys[:, [2, 3, 0, 1]], keys)
