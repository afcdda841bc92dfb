"""From a drawing's lines to a map: units, doubles, faces, directions."""

from __future__ import annotations

import math

import numpy as np

from registration import InputError, Segments
from registration.layout import Floats

from ...errors import IncompleteFileError, MalformedFileError
from ...line_map import LineMap
from ...options import UNITS
from ..drawing import Drawing
from .centre_lines import are_centres, outline, thickness_of
from .far_lines import near_lines
from .free_sides import Sides, sides_seen
from .levels import on_level, undirected

LEAST_LENGTH = 0.01  # m; shorter lines are left out
SAME = 1e-3  # m; lines whose ends are nearer to one another are one

# m; the length such that half of the length of all lines is in longer ones. Of 282 plans of flats, houses and public
# buildings it is 1.0 to 14.2 m.
LEAST_USUAL, USUAL, GREATEST_USUAL = 0.6, 3.0, 20.0
OFTEN_MISTAKEN = ("mm", "cm", "m", "in", "ft")  # for one another


def to_map(drawing: Drawing) -> LineMap:
    """Make a map of a drawing.

    Parameters
    ----------
    drawing : Drawing
        Its notes take what was done.

    Raises
    ------
    IncompleteFileError
        When the length of a unit is unknown.
    MalformedFileError
        When no wall is left, or one is longer than a map can have.
    InvalidOptionError
        When a free place lies on a wall or outside.
    """
    options = drawing.options
    metres = options.metres or drawing.metres
    drawing.leave_out_others()
    if not drawing.polylines:
        raise drawing.without_lines()
    if metres is None:
        doubt = drawing.notes.assumed.get("unknown_unit")
        why = f": {doubt.message}" if doubt is not None else ""
        raise IncompleteFileError(f"does not state its unit{why}; set the option units, for example to mm or m")
    drawing.require_plan()
    drawing.polylines = on_level(drawing, metres)
    endpoints = np.vstack([one.ends for one in drawing.polylines]) * metres
    lengths = [len(one.ends) for one in drawing.polylines]
    widths = np.repeat([one.width for one in drawing.polylines], lengths) * metres
    oriented = drawing.oriented and not options.point
    if options.oriented is not None:
        oriented = options.oriented
    if drawing.format != "json":  # a map of our own stays as it is: others count its segments
        near = near_lines(endpoints, np.repeat(np.arange(len(lengths)), lengths), drawing)
        endpoints, widths = endpoints[near], widths[near]
        _note_unit(endpoints, metres, drawing)
        endpoints, widths = _without_doubles(endpoints, widths, oriented, drawing)
    if are_centres(endpoints, drawing):
        endpoints, oriented = _with_faces(endpoints, widths, drawing), True
    elif options.point:
        endpoints, oriented = _directed(endpoints, drawing), True
    if not oriented:
        drawing.notes.add_assumed(
            "directions",
            "directions are ignored, because the free side of the lines is unknown; set the option point to a free "
            "place or, for centre lines, the options drawn (centres) and thickness",
        )
    drawing.notes.add_read("segments", "faces of walls" if oriented else "lines", len(endpoints))
    meta = drawing.meta if drawing.format == "json" and drawing.meta else {"source": drawing.name} | drawing.meta
    points, sigma = drawing.points * metres, drawing.points_sigma
    if len(points):
        drawing.notes.add_read("points", "points", len(points))
    return LineMap(_segments(endpoints, drawing), drawing.sigma, oriented, drawing.frame_id, meta, points, sigma)


def _without_doubles(endpoints: Floats, widths: Floats, oriented: bool, drawing: Drawing) -> tuple[Floats, Floats]:
    lengths = np.hypot(*(endpoints[:, 2:] - endpoints[:, :2]).T)
    long = lengths >= LEAST_LENGTH
    if not long.all():
        drawing.notes.add_dropped("short", f"lines shorter than {LEAST_LENGTH:g} m", int((~long).sum()))
    endpoints, widths = endpoints[long], widths[long]
    if len(endpoints) == 0:
        doubt = drawing.notes.assumed.get("unlikely_unit")
        why = doubt.message if doubt is not None else "check the unit"
        raise MalformedFileError(f"has no line of {LEAST_LENGTH:g} m: {why}")
    keys = np.rint(endpoints / SAME) if oriented else undirected(endpoints / SAME)
    _, first = np.unique(keys, axis=0, return_index=True)
    if len(first) < len(endpoints):
        drawing.notes.add_merged("doubles", "lines drawn more than once", len(endpoints) - len(first))
    first.sort()
    return endpoints[first], widths[first]


def _with_faces(endpoints: Floats, widths: Floats, drawing: Drawing) -> Floats:
    """Return both faces of walls drawn by their centre line, free space on the left."""
    thickness = thickness_of(widths, drawing)
    drawing.notes.add_merged("faces", "centre lines made into two faces", len(endpoints))
    drawing.meta |= {"thickness": f"{float(np.median(thickness)):.3g}"}
    return outline(_segments(endpoints, drawing).endpoints, thickness)


def _directed(endpoints: Floats, drawing: Drawing) -> Floats:
    """Return lines with free space on the left; in both directions if it is on both sides or unknown."""
    seen = sides_seen(endpoints, drawing.options.point)
    backward = endpoints[:, [2, 3, 0, 1]]
    counts = np.bincount(seen, minlength=len(Sides))
    one_sided = int(counts[Sides.LEFT] + counts[Sides.RIGHT])
    drawing.notes.add_assumed("inside", "directions derived from the free places", one_sided)
    for side, code, which in (
        (Sides.BOTH, "both_sides", "with free space on both sides"),
        (Sides.NEITHER, "not_reached", "that no free place reaches"),
    ):
        if counts[side]:
            drawing.notes.add_assumed(code, f"lines {which}; both directions are used", int(counts[side]))
    left, right = seen != Sides.RIGHT, seen != Sides.LEFT
    return np.vstack([endpoints[left], backward[right]])


def _segments(endpoints: Floats, drawing: Drawing) -> Segments:
    try:
        return Segments.from_array(endpoints, argument="line")
    except InputError as error:
        raise MalformedFileError(f"a line {error.message}; check the unit") from error


def _note_unit(endpoints: Floats, metres: float, drawing: Drawing) -> None:
    """Note the unit and the size of a drawing, and units that are likelier where lines are unusually long or short.

    Parameters
    ----------
    endpoints : (n, 4)
        Metres.
    metres : float
        Per unit.
    drawing : Drawing
        Its notes take it.
    """
    corners = endpoints.reshape(-1, 2)
    width, height = corners.max(axis=0) - corners.min(axis=0)
    stated = "is usual in a table" if drawing.format == "csv" and metres == 1.0 else "the file states"
    who = stated if drawing.options.metres is None else "the option states"
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
        f"in {name} it is {likely[name]:.3g} m (a factor of {max(UNITS[name] / metres, metres / UNITS[name]):.6g})"
        for name in plausible
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
