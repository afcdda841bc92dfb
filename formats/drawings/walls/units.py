"""Plausibility of the unit of a drawing, from the lengths of its lines."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ...options import UNITS, ImportOptions
from ..drawing import Drawing

Floats = NDArray[np.float64]

# m; the length such that half of the length of all lines is in longer ones. Of 282 plans of flats, houses and public
# buildings it is 1.0 to 14.2 m.
LEAST_USUAL, USUAL, GREATEST_USUAL = 0.6, 3.0, 20.0
OFTEN_MISTAKEN = ("mm", "cm", "m", "in", "ft")  # for one another


def note_unit(endpoints: Floats, metres: float, drawing: Drawing, options: ImportOptions) -> None:
    """Note the unit and the size of a drawing, and units that are likelier where lines are unusually long or short.

    Parameters
    ----------
    endpoints : (n, 4)
        Metres.
    metres : float
        Per unit.
    drawing : Drawing
        Its notes take it.
    options : ImportOptions
    """
    corners = endpoints.reshape(-1, 2)
    width, height = corners.max(axis=0) - corners.min(axis=0)
    who = "the option states" if options.metres is not None else "the file states"
    unit = _named(metres)
    drawing.notes.add_read("unit", f"1 unit is {unit}, as {who}: the drawing is {width:.4g} m by {height:.4g} m")
    lengths = np.sort(np.hypot(*(endpoints[:, 2:] - endpoints[:, :2]).T))
    usual = float(lengths[np.searchsorted(np.cumsum(lengths), 0.5 * lengths.sum())])
    if LEAST_USUAL <= usual <= GREATEST_USUAL:
        return
    likely = {name: UNITS[name] / metres * usual for name in OFTEN_MISTAKEN if not math.isclose(UNITS[name], metres)}
    plausible = [name for name, length in likely.items() if LEAST_USUAL <= length <= GREATEST_USUAL]
    plausible.sort(key=lambda name: abs(math.log(likely[name] / USUAL)))
    others = "; ".join(
        f"in {name} it is {likely[name]:.3g} m (a factor of {_factor(UNITS[name], metres)})" for name in plausible
    )
    drawing.notes.add_assumed(
        "unlikely_unit",
        f"the unit is {unit}, but with it the usual line is {usual:.3g} m long, and {LEAST_USUAL:g} to "
        f"{GREATEST_USUAL:g} m in plans of buildings{'; ' if others else ''}{others}; set the option units if "
        "another unit is correct",
    )


def _named(metres: float) -> str:
    name = next((name for name, value in UNITS.items() if math.isclose(value, metres, rel_tol=1e-6)), None)
    return f"{metres:g} m" + (f" ({name})" if name is not None and name != "m" else "")


def _factor(one: float, other: float) -> str:
    return f"{max(one, other) / min(one, other):.6g}"
