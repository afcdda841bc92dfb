"""Which levels of a grid stand for cells of which nothing is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import tuning

Counts = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class UnknownLevels:
    """Levels of occupancy, 0 (free) to 255 (occupied), that stand for unknown cells.

    Attributes
    ----------
    taken : (256,) bool
        Levels whose cells are unknown.
    spikes : tuple of int
        The level of each group in `taken` that has the most cells.
    refused : tuple of int
        Levels that tools write for unknown cells, but which are the lightest or the darkest of this grid.
    """

    taken: Flags
    spikes: tuple[int, ...] = ()
    refused: tuple[int, ...] = ()


def find_unknown_levels(counts: Counts, shades: tuple[int, ...], between: tuple[int, int]) -> UnknownLevels:
    """Find the levels of unknown cells in the histogram of a grid.

    A level stands for unknown cells where lighter ones are free, darker ones are occupied, and it is one that tools
    write, or stands out of the histogram.

    Parameters
    ----------
    counts : (256,)
        Cells of each level of occupancy, light first.
    shades : tuple of int
        Levels that tools write for unknown cells.
    between : (int, int)
        The levels that the thresholds of the file call neither free nor occupied, first and last.
    """
    usual = sorted({peak for shade in shades if (peak := _peak_near(counts, shade)) is not None})
    lighter, darker = np.cumsum(counts) - counts, int(counts.sum()) - np.cumsum(counts)
    spikes = [k for k in usual if lighter[k] >= tuning.LEAST_CELLS and darker[k] >= tuning.LEAST_CELLS]
    if not spikes and (spike := find_unknown_level(counts, between)) is not None:
        spikes = [spike]
    taken = np.zeros(tuning.LEVELS, dtype=np.bool_)
    for spike in spikes:
        taken |= _with_noise(counts, spike)
    refused = tuple(k for k in usual if k not in spikes)
    return UnknownLevels(taken, tuple(spikes), refused if not spikes else ())


def given_levels(levels: tuple[int, ...]) -> UnknownLevels:
    """Return the levels that the caller says stand for unknown cells; none where there are no unknown cells."""
    taken = np.zeros(tuning.LEVELS, dtype=np.bool_)
    taken[list(levels)] = True
    return UnknownLevels(taken, levels)


def free_end(counts: Counts, unknown: int) -> float:
    """Return the level below which cells may be free, given the lightest level of unknown cells.

    If most lighter cells have one level, it is halfway between: resizing and compression make cells near walls
    lighter than unknown ones are.
    """
    lighter = counts[:unknown]
    free = int(np.argmax(lighter)) if unknown else 0
    return 0.5 * (free + unknown) if 2 * int(lighter.max(initial=0)) > int(lighter.sum()) else float(unknown)


def find_unknown_level(counts: Counts, between: tuple[int, int] = (1, 0)) -> int | None:
    """Find the one level between light and dark that stands out of a histogram.

    Parameters
    ----------
    counts : (256,)
        Cells of each level of occupancy, light first.
    between : (int, int)
        The levels that the thresholds of the file call neither free nor occupied, first and last.

    Returns
    -------
    int or None
        None where no level between light and dark stands out.
    """
    total = int(counts.sum())
    beside = np.maximum(np.r_[0, counts[:-1]], np.r_[counts[1:], 0])
    stands_out = (counts > tuning.SPIKE_SHARE * total) & (counts > tuning.SPIKE_RATIO * beside)
    spikes = np.flatnonzero(stands_out)
    if len(spikes) < 2:
        return None
    free = int(counts[spikes[0]])
    darker = total - np.cumsum(counts)
    # Walls around a large hall are few cells: their number grows with the side of the free area, not with the area.
    least = max(float(tuning.LEAST_CELLS), min(tuning.DARKER_SHARE * free, free**0.5))
    fit = [
        k
        for k in spikes[1:]
        if k <= tuning.DARKEST_UNKNOWN * (tuning.LEVELS - 1)
        and (darker[k] >= least or (between[0] <= k <= between[1] and darker[k] >= tuning.LEAST_CELLS))
    ]
    return int(max(fit, key=lambda k: counts[k])) if fit else None


def _peak_near(counts: Counts, shade: int) -> int | None:
    """Return the level next to a shade that stands out of all others around it; None where none does."""
    low, high = max(0, shade - tuning.SHADE_REACH), min(tuning.LEVELS, shade + tuning.SHADE_REACH + 1)
    peak = low + int(np.argmax(counts[low:high]))
    around = counts[max(0, peak - tuning.SPIKE_WINDOW) : peak + tuning.SPIKE_WINDOW + 1]
    others = np.sort(around)[:-1]
    stands_out = counts[peak] >= tuning.LEAST_CELLS and counts[peak] > tuning.SPIKE_RATIO * int(others[-1])
    return peak if stands_out else None


def _with_noise(counts: Counts, spike: int) -> Flags:
    """Return the level of a spike, and those around it where a compression spread its cells."""
    taken = np.zeros(tuning.LEVELS, dtype=np.bool_)
    taken[spike] = True
    distance = np.abs(np.arange(tuning.LEVELS) - spike)
    near = int(counts[(distance > 0) & (distance <= tuning.NOISE_REACH)].sum())
    far = int(counts[(distance > tuning.NOISE_REACH) & (distance <= 3 * tuning.NOISE_REACH)].sum())
    if near > tuning.NOISE_RATIO * far:  # a gradient has as many cells farther from the spike
        taken[distance <= 2 * tuning.NOISE_REACH] = True
    return taken
