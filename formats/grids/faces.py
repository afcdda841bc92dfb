"""The faces of walls in a grid: contours of the free space, cut into lines by least squares."""

from __future__ import annotations

from collections.abc import Iterator

import contourpy
import numpy as np
from numpy.typing import NDArray

from registration import Segments
from vectorization import VectorizationOptions, vectorize

from ..errors import MalformedFileError, TooLargeError
from ..limits import MAX_SEGMENTS
from ..report import Notes
from .cells import FREE, OCCUPIED, UNKNOWN, Cells, Grid, classify
from .tuning import (
    BAND_SHARE,
    CONTOUR_SIGMA,
    CORNER_REACH,
    GREATEST_BAND,
    LEAST_DEPTH,
    LEAST_LENGTH,
    LEAST_POINTS,
    LONGEST_CONTOUR,
)

DECIDED = ("thresholds", "unknown_grey")  # notes on how cells were told apart

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


def find_faces(grid: Grid, notes: Notes, name: str) -> Segments:
    """Find the faces of the walls in a grid.

    Contours of the free space have it on their left. A border with unknown cells is no wall. The
    contour runs along the front of the occupied cells, the wall's surface behind it: see `surface_depth`.

    Parameters
    ----------
    grid : Grid
    notes : Notes
    name : str
        Of the file, for errors.

    Returns
    -------
    Segments
        Metres in the map frame, free space on the left.

    Raises
    ------
    MalformedFileError
        When no free cell borders on an occupied one.
    TooLargeError
        When there are too many segments.
    """
    cells = classify(grid, notes)
    for name_of_kind, kind in (("free", FREE), ("occupied", OCCUPIED), ("unknown", UNKNOWN)):
        count = int((cells == kind).sum())
        notes.add_read(f"{name_of_kind}_cells", f"{name_of_kind} cells" if count else f"no {name_of_kind} cell", count)
    depth = surface_depth(cells)
    options = VectorizationOptions(
        sigma=CONTOUR_SIGMA * grid.resolution, min_length=max(1e-3, LEAST_LENGTH * grid.resolution)
    )
    found: list[Floats] = []
    points = 0
    for contour in wall_contours(cells):
        lines = vectorize(contour * grid.resolution, options, viewpoint=None).measured
        points += len(contour) - int(lines.point_counts.sum())
        if len(lines):
            found.append(lines.segments.endpoints - np.tile(lines.segments.normals * depth * grid.resolution, 2))
        if sum(map(len, found)) > MAX_SEGMENTS:
            raise TooLargeError(
                f"expected a grid of at most {MAX_SEGMENTS} segments, found more; crop it, or remove noise",
                argument=name,
            )
    if not found:
        counts = ", ".join(
            f"{int((cells == kind).sum())} {word}"
            for word, kind in (("free", FREE), ("occupied", OCCUPIED), ("unknown", UNKNOWN))
        )
        said = "".join(f"; {note.message}" for code, note in notes.assumed.items() if code in DECIDED)
        raise MalformedFileError(
            f"no wall found: expected a straight border between free and occupied cells, found {counts} cells{said}",
            argument=name,
        )
    if points > 0:
        notes.add_dropped(
            "short_pieces", f"cell borders outside of straight lines of at least {LEAST_LENGTH:g} cells", points
        )
    notes.add_assumed("surface", f"wall surfaces are assumed {depth:.2f} cells behind the border of the free cells")
    return Segments.from_array(_placed(np.vstack(found), grid))


def surface_depth(cells: Cells) -> float:
    """Return how far behind the front of the occupied cells the surface of the walls lies, in cells.

    Returns of a range finder scatter about the surface. A wall seen from one side is a band of occupied cells with
    nothing known behind; the thicker these bands are, the farther the returns were scattered.
    """
    bands = np.concatenate([_bands(np.rot90(cells, k)) for k in range(4)])
    if len(bands) == 0:
        return LEAST_DEPTH
    return max(LEAST_DEPTH, BAND_SHARE * float(np.median(bands)))


def _bands(cells: Cells) -> NDArray[np.int64]:
    """Return the thickness of each band with a free cell on its left and an unknown one on its right."""
    padded = np.pad(cells, ((0, 0), (1, GREATEST_BAND + 1)), constant_values=UNKNOWN)
    rows, columns = np.nonzero((padded[:, :-1] == FREE) & (padded[:, 1:] == OCCUPIED))
    thickness = np.zeros(len(rows), dtype=np.int64)
    last = padded.shape[1] - 1
    for k in range(1, GREATEST_BAND + 1):
        thickness += (thickness == k - 1) & (padded[rows, np.minimum(columns + k, last)] == OCCUPIED)
    behind = padded[rows, np.minimum(columns + thickness + 1, last)]
    seen_from_one_side = (behind == UNKNOWN) & (thickness < GREATEST_BAND)
    return np.asarray(thickness[seen_from_one_side])


def wall_contours(cells: Cells) -> Iterator[Floats]:
    """Yield the points of each contour between free and occupied cells, free space on the left.

    Parameters
    ----------
    cells : (rows, columns)
        Row 0 is the lowest: in a picture whose rows run down every direction would be mirrored.

    Yields
    ------
    (n, 2)
        In order along the border, cells from the grid's lower left corner.
    """
    # contourpy keeps the higher side on the left. Around the grid nothing is known.
    padded = np.pad(cells, 1, constant_values=UNKNOWN)
    generator = contourpy.contour_generator(
        z=(padded == FREE).astype(np.float64), line_type=contourpy.LineType.Separate
    )
    for line in generator.lines(0.5):
        contour = np.asarray(line, dtype=np.float64)
        wall = _borders_on_wall(contour, padded)
        if np.array_equal(contour[0], contour[-1]):
            contour, wall = contour[:-1], wall[:-1]
            start = sharpest_corner(contour) if wall.all() else int(np.argmin(wall))
            contour, wall = np.roll(contour, -start, axis=0), np.roll(wall, -start)
        places = contour[wall] - 0.5
        for k in range(0, len(places), LONGEST_CONTOUR):
            if len(places) - k >= LEAST_POINTS:
                yield places[k : k + LONGEST_CONTOUR]


def sharpest_corner(contour: Floats) -> int:
    """Return the point of a closed contour at which a new side begins most clearly.

    A line that began before a corner would keep the points there.

    Parameters
    ----------
    contour : (n, 2)
        Without the first point repeated.
    """
    before = np.roll(contour, 1, axis=0) - np.roll(contour, 1 + CORNER_REACH, axis=0)
    after = np.roll(contour, -CORNER_REACH, axis=0) - contour
    products = np.einsum("ij,ij->i", before, after)
    scale = np.hypot(*before.T) * np.hypot(*after.T)
    return int(np.argmin(np.divide(products, scale, out=np.ones(len(contour)), where=scale > 0.0)))


def _borders_on_wall(contour: Floats, padded: Cells) -> Flags:
    """Tell which points of a contour, each halfway between two cells, border on an occupied one."""
    low, high = np.floor(contour).astype(np.intp), np.ceil(contour).astype(np.intp)
    wall: Flags = (padded[low[:, 1], low[:, 0]] == OCCUPIED) | (padded[high[:, 1], high[:, 0]] == OCCUPIED)
    return wall


def _placed(endpoints: Floats, grid: Grid) -> Floats:
    """Return endpoints in the map frame."""
    placed: Floats = grid.origin.apply(endpoints.reshape(-1, 2)).reshape(-1, 4)
    return placed
