"""The faces of walls in a grid: contours of the free space, cut into lines by least squares."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import contourpy
import numpy as np
import scipy
from numpy.typing import NDArray

from registration import Segments
from registration.layout import Floats
from vectorization import VectorizationOptions, vectorize

from ..errors import MalformedFileError, TooLargeError
from ..limits import MAX_POINTS, MAX_SEGMENTS
from ..report import Notes
from . import tuning
from .cells import FREE, OCCUPIED, UNKNOWN, Cells, Grid, classify

KINDS = {"free": FREE, "occupied": OCCUPIED, "unknown": UNKNOWN}
DECIDED = ("costmap", "transparent", "thresholds", "unknown_grey", "inverted")  # notes on how cells were told apart

WHY_DRAWN = "because walls have a constant thickness, as in a drawn grid; set the option surface for another value"
WHY_MAPPED = "by the thickness of walls that are seen from one side, as in a mapped grid"

Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Faces:
    """The walls and small objects of a grid.

    Attributes
    ----------
    segments : Segments
        The faces of its walls, metres in the map frame, free space on the left.
    points : (n, 2)
        The occupied cells next to free ones that are on no face: their middles, metres in the map frame.
    depth : float
        From the front of the occupied cells to the segments, cells.
    """

    segments: Segments
    points: Floats
    depth: float


def find_faces(grid: Grid, notes: Notes, surface: float | None = None) -> Faces:
    """Find the faces of the walls in a grid, and what is too small for one.

    Contours of the free space have it on their left. A border with unknown cells is no wall. The
    contour runs along the front of the occupied cells, the wall's surface behind it: see `surface_depth`.

    Parameters
    ----------
    grid : Grid
    notes : Notes
    surface : float or None
        Depth of the walls' surface behind the front, cells; None: estimated from the grid.

    Returns
    -------
    Faces

    Raises
    ------
    MalformedFileError
        When no free cell borders on an occupied one.
    TooLargeError
        When there are too many segments.
    """
    cells = classify(grid, notes)
    counts = {word: int((cells == kind).sum()) for word, kind in KINDS.items()}
    if counts["occupied"] > tuning.INVERTED * counts["free"]:
        notes.add_assumed(
            "inverted",
            f"{counts['occupied']} cells are occupied and {counts['free']} free; if free cells are the dark ones, set "
            "negate to 1 in the YAML file",
        )
    for word, count in counts.items():
        notes.add_read(f"{word}_cells", f"{word} cells" if count else f"no {word} cell", count)
    depth, drawn = surface_depth(cells) if surface is None else (surface, False)
    fronts, normals = _fronts(cells, grid)
    if not len(fronts):
        told = ", ".join(f"{count} {word}" for word, count in counts.items())
        said = "".join(f"; {note.message}" for code, note in notes.assumed.items() if code in DECIDED)
        raise MalformedFileError(
            f"no wall found: expected a straight border between free and occupied cells, found {told} cells{said}"
        )
    why = "as an option states" if surface is not None else WHY_DRAWN if drawn else WHY_MAPPED
    notes.add_assumed(
        "surface", f"wall surfaces are assumed {depth:.2f} cells behind the border of the free cells, {why}"
    )
    walls = fronts - np.tile(normals * depth * grid.resolution, 2)
    points = _points(fronts / grid.resolution, cells, notes)
    placed = grid.origin.apply(walls.reshape(-1, 2))
    return Faces(Segments.from_array(placed.reshape(-1, 4)), grid.origin.apply(points * grid.resolution), depth)


def _fronts(cells: Cells, grid: Grid) -> tuple[Floats, Floats]:
    """Return the lines along the fronts of the occupied cells, (n, 4), metres, and their normals, (n, 2)."""
    size = grid.resolution
    options = VectorizationOptions(sigma=tuning.CONTOUR_SIGMA * size, min_length=max(1e-3, tuning.LEAST_LENGTH * size))
    fronts, normals, count = [np.zeros((0, 4))], [np.zeros((0, 2))], 0
    for contour in wall_contours(cells):
        lines = vectorize(contour * size, options, viewpoint=None).measured.segments
        fronts.append(lines.endpoints)
        normals.append(lines.normals)
        count += len(lines)
        if count > MAX_SEGMENTS:
            raise TooLargeError(
                f"expected a grid of at most {MAX_SEGMENTS} segments, found more; crop it, or remove noise"
            )
    return np.concatenate(fronts), np.concatenate(normals)


def _points(fronts: Floats, cells: Cells, notes: Notes) -> Floats:
    """Return the middles of the occupied cells next to free ones that lie on no front, (n, 2); none of too many.

    Parameters
    ----------
    fronts : (m, 4)
        The lines along the fronts of the occupied cells, in cells, as the result.
    """
    row, column = np.nonzero((cells == OCCUPIED) & scipy.ndimage.binary_dilation(cells == FREE))
    middles = np.column_stack([column + 0.5, row + 0.5])
    on_fronts = Segments.derived(fronts).points(0.5)
    away, _ = scipy.spatial.cKDTree(on_fronts).query(middles, distance_upper_bound=tuning.COVERED)
    points = np.asarray(middles[np.isinf(away)])
    if len(points) > MAX_POINTS:
        what = f"cells that are on no wall, more than the {MAX_POINTS} points of a map"
        notes.add_dropped("points", what, len(points))
        return np.zeros((0, 2))
    if len(points):
        notes.add_read("points", "occupied cells that are on no wall", len(points))
    return points


def surface_depth(cells: Cells) -> tuple[float, bool]:
    """Return how far behind the front of the occupied cells the surface of the walls lies, in cells; True if drawn.

    Walls of a drawn grid are bands whose thickness hardly changes from cell to cell: their surface is the front. In a
    mapped grid returns of a range finder scatter about the surface. A wall seen from one side is a band of occupied
    cells with nothing known behind; the thicker these bands are, the farther the returns were scattered.
    """
    bands = [_bands(np.rot90(cells, k)) for k in range(4)]
    every = np.concatenate([thickness[thickness > 0] for thickness, _ in bands])
    usual = float(np.median(every)) if len(every) >= tuning.LEAST_STEPS else 0.0
    if usual > tuning.THIN:  # else a cell more or less is no evidence, or the surface is in the middle of the only cell
        steps = np.concatenate([_steps(thickness) for thickness, _ in bands])
        if float((steps <= (1 if usual > 2.0 * tuning.THIN else 0)).mean()) >= tuning.DRAWN:
            return 0.0, True
    one_sided = np.concatenate([thickness[behind] for thickness, behind in bands])
    behind_front = tuning.BAND_SHARE * float(np.median(one_sided)) if len(one_sided) else 0.0
    return max(tuning.LEAST_DEPTH, behind_front), False


def _bands(cells: Cells) -> tuple[NDArray[np.int8], Flags]:
    """Return the thickness of the band of occupied cells that begins behind each free cell, 0 where none does.

    The second array tells which bands have an unknown cell behind, and so are seen from one side. Thicker bands than
    `GREATEST_BAND` are as thick as that.
    """
    padded = np.pad(cells, ((0, 0), (1, tuning.GREATEST_BAND + 1)), constant_values=UNKNOWN)
    width = cells.shape[1]
    front = (padded[:, :width] == FREE) & (padded[:, 1 : width + 1] == OCCUPIED)
    thickness, behind = np.zeros(front.shape, dtype=np.int8), np.zeros(front.shape, dtype=np.bool_)
    for k in range(1, tuning.GREATEST_BAND + 1):
        at = padded[:, k : k + width]
        behind |= front & (thickness == k - 1) & (k > 1) & (at == UNKNOWN)
        thickness += front & (thickness == k - 1) & (at == OCCUPIED)
    return thickness, behind


def _steps(thickness: NDArray[np.int8]) -> NDArray[np.int8]:
    """Return how much the thickness of bands differs from that of the next row, where they begin side by side."""
    found = []
    for shift in (-1, 0, 1):
        here, there = thickness[:-1], np.roll(thickness[1:], shift, axis=1)
        both = (here > 0) & (there > 0)
        found.append(np.abs(here[both] - there[both]))
    return np.concatenate(found)


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

    Raises
    ------
    TooLargeError
        When there are as many as in noise.
    """
    # contourpy keeps the higher side on the left. Around the grid nothing is known.
    padded = np.pad(cells, 1, constant_values=UNKNOWN)
    generator = contourpy.contour_generator(
        z=(padded == FREE).astype(np.float64), line_type=contourpy.LineType.Separate
    )
    lines = generator.lines(0.5)
    most = max(tuning.MANY_CONTOURS, int(cells.size * tuning.MOST_CONTOURS))
    if len(lines) > most:
        raise TooLargeError(
            f"expected at most {most} borders of free cells, one in {1 / tuning.MOST_CONTOURS:g} cells, found "
            f"{len(lines)}; remove noise from the picture"
        )
    for line in lines:
        contour = np.asarray(line, dtype=np.float64)
        # Each point is halfway between two cells.
        sides = (np.floor(contour).astype(np.intp), np.ceil(contour).astype(np.intp))
        wall = np.any([padded[side[:, 1], side[:, 0]] == OCCUPIED for side in sides], axis=0)
        if np.array_equal(contour[0], contour[-1]):
            contour, wall = contour[:-1], wall[:-1]
            start = sharpest_corner(contour) if wall.all() else int(np.argmin(wall))
            contour, wall = np.roll(contour, -start, axis=0), np.roll(wall, -start)
        places = contour[wall] - 0.5
        for k in range(0, len(places), tuning.LONGEST_CONTOUR):
            if len(places) - k >= tuning.LEAST_POINTS:
                yield places[k : k + tuning.LONGEST_CONTOUR]


def sharpest_corner(contour: Floats) -> int:
    """Return the point of a closed contour at which a new side begins most clearly.

    A line that began before a corner would keep the points there.

    Parameters
    ----------
    contour : (n, 2)
        Without the first point repeated.
    """
    before = np.roll(contour, 1, axis=0) - np.roll(contour, 1 + tuning.CORNER_REACH, axis=0)
    after = np.roll(contour, -tuning.CORNER_REACH, axis=0) - contour
    products = np.einsum("ij,ij->i", before, after)
    scale = np.hypot(*before.T) * np.hypot(*after.T)
    return int(np.argmin(np.divide(products, scale, out=np.ones(len(contour)), where=scale > 0.0)))
