"""Unknown cells of a grid: recognised from the picture, whatever tool wrote it and whatever its thresholds say."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from formats import ImportedMap, ImportOptions, InvalidOptionError, MalformedFileError, read_map

from .reading import counts, notes

Pixels = NDArray[np.uint8]

FREE, UNKNOWN, WALL = 254, 205, 0
TRINARY = {WALL: 0, UNKNOWN: 1, FREE: 2}
LONG = pytest.mark.long


def sheet() -> Pixels:
    """A hall of 30 m by 20 m, 0.1 m a cell, whose walls are one cell thick, on a sheet that is mostly unknown."""
    up = np.full((420, 640), UNKNOWN, dtype=np.uint8)
    up[100:300, 150:450] = FREE
    up[99, 150:450] = up[300, 150:450] = up[99:301, 149] = WALL  # the right side was never seen
    return up


THREE_WALLS = {(0, 9.95, 30.0), (180, -30.05, 30.0), (270, 14.95, 20.0)}


def shades(free: int, unknown: int, wall: int) -> Pixels:
    up = sheet()
    return np.choose(np.searchsorted([WALL, UNKNOWN, FREE], up), [wall, unknown, free]).astype(np.uint8)


def imported(
    folder: Path,
    picture: Image.Image,
    options: ImportOptions | None = None,
    *,
    name: str = "map.png",
    said: str = "",
    **saved: Any,
) -> ImportedMap:
    picture.transpose(Image.Transpose.FLIP_TOP_BOTTOM).save(folder / name, **saved)
    (folder / "map.yaml").write_text(f"image: {name}\nresolution: 0.1\norigin: [0, 0, 0]\n{said or thresholds()}")
    return read_map(folder / "map.yaml", options or ImportOptions())


def walls(found: ImportedMap) -> set[tuple[int, float, float]]:
    """Direction in whole degrees, offset to 5 cm and length to a metre of the walls of more than a metre."""
    s = found.map.segments
    angles = np.rint(np.degrees(np.arctan2(s.directions[:, 1], s.directions[:, 0]))).astype(int) % 360
    rows = zip(angles, np.round(s.offsets / 0.05) * 0.05, np.round(s.lengths), s.lengths, strict=True)
    return {(int(a), round(float(o), 2), float(n)) for a, o, n, exact in rows if exact > 1.0}


def cells(found: ImportedMap) -> list[int]:
    """Return how many are free, occupied and unknown."""
    return [counts(found)[f"{kind}_cells"] for kind in ("free", "occupied", "unknown")]


def is_the_hall(found: ImportedMap) -> bool:
    return walls(found) == THREE_WALLS and cells(found) == [60_000, 802, 420 * 640 - 60_802]


def thresholds(free: float = 0.196, occupied: float = 0.65, *, negate: int = 0) -> str:
    return f"negate: {negate}\noccupied_thresh: {occupied}\nfree_thresh: {free}\n"


@pytest.mark.parametrize("free_thresh", [0.1, 0.196, 0.1961, 0.2, 0.25, 0.5])
@pytest.mark.parametrize("unknown", [205, 200, 128, 127])
def test_unknown_cells_have_the_value_that_tools_write(tmp_path: Path, unknown: int, free_thresh: float) -> None:
    found = imported(tmp_path, Image.fromarray(shades(FREE, unknown, WALL)), said=thresholds(free_thresh))
    assert is_the_hall(found)
    freed = (255 - unknown) / 255 < free_thresh
    assert ("unknown_grey" in notes(found)) == freed
    if freed:
        assert f"cells of grey value {unknown} are unknown" in notes(found)["unknown_grey"].message
        assert "option unknown" in notes(found)["unknown_grey"].message


@pytest.mark.parametrize(
    ("said", "greys"),
    [
        *((thresholds(0.1, occupied), (FREE, 205, WALL)) for occupied in (0.15, 0.4, 0.5, 0.65, 0.9, 0.999)),
        *((thresholds(0.1, occupied), (FREE, 128, WALL)) for occupied in (0.15, 0.4, 0.5, 0.65, 0.9, 0.999)),
        # Other values stand out of the picture.
        *(("", greys) for greys in ((255, 230, 127), (255, 153, 0), (250, 180, 60), (240, 210, 20), (205, 128, 0))),
        # Inverted as a whole, or with unknown cells left at 205, which negated is 0.804: occupied by every threshold.
        *((thresholds(0.1, negate=1), greys) for greys in ((0, 205, 254), (1, 50, 255), (0, 128, 255), (0, 55, 254))),
        *((thresholds(0.25, negate=1), greys) for greys in ((0, 205, 254), (1, 50, 255), (0, 128, 255), (0, 55, 254))),
    ],
)
def test_neither_thresholds_nor_grey_values_make_unknown_cells_walls(
    tmp_path: Path, said: str, greys: tuple[int, int, int]
) -> None:
    assert is_the_hall(imported(tmp_path, Image.fromarray(shades(*greys)), said=said))


def sixteen_bits(up: Pixels) -> Image.Image:
    return Image.fromarray(up.astype(np.uint16) * 256 + 17)


def palette(up: Pixels) -> Image.Image:
    indexed = Image.frombytes("P", up.shape[::-1], np.vectorize(TRINARY.get)(up).astype(np.uint8).tobytes())
    indexed.putpalette([0, 0, 0, 205, 205, 205, 254, 254, 254])
    return indexed


def see_through(up: Pixels) -> Image.Image:
    """Unknown is half transparent black."""
    alpha = np.where(up == UNKNOWN, 128, 255).astype(np.uint8)
    grey = np.where(up == UNKNOWN, 0, up).astype(np.uint8)
    return Image.merge("RGBA", [Image.fromarray(grey)] * 3 + [Image.fromarray(alpha)])


def grey_and_alpha(up: Pixels) -> Image.Image:
    grey, alpha = np.where(up == UNKNOWN, 254, up), np.where(up == UNKNOWN, 0, 255)
    return Image.merge("LA", [Image.fromarray(one.astype(np.uint8)) for one in (grey, alpha)])


def coloured(up: Pixels) -> Image.Image:
    """Unknown is a light blue whose mean is 205."""
    rgb = np.stack([up, up, up], axis=2)
    rgb[up == UNKNOWN] = [180, 205, 230]
    return Image.fromarray(rgb)


@pytest.mark.parametrize("drawn", [sixteen_bits, palette, see_through, grey_and_alpha, coloured])
@pytest.mark.parametrize("mode", ["trinary", "scale"])
def test_kinds_of_pictures(tmp_path: Path, drawn: Callable[[Pixels], Image.Image], mode: str) -> None:
    assert is_the_hall(imported(tmp_path, drawn(sheet()), said=f"{thresholds(0.25)}mode: {mode}\n"))


@pytest.mark.parametrize("kind", ["L", "I;16"])
def test_a_transparent_grey_value(tmp_path: Path, kind: str) -> None:
    """A PNG may state that one grey value is transparent: here 254, which would be free."""
    up = np.where(sheet() == UNKNOWN, 254, np.where(sheet() == FREE, 255, 0)).astype(np.uint8)
    picture = Image.fromarray(up if kind == "L" else up.astype(np.uint16))
    if kind == "I;16":
        picture = Image.fromarray(np.where(up == 255, 65_535, up).astype(np.uint16))
    assert is_the_hall(imported(tmp_path, picture, transparency=254))


def thick_sheet() -> Image.Image:
    thick = sheet()
    thick[96:99, 149:450] = thick[301:304, 149:450] = thick[96:304, 146:149] = WALL
    return Image.fromarray(thick)


@pytest.mark.parametrize("quality", [50, pytest.param(75, marks=LONG), 95])
@pytest.mark.parametrize("name", ["map.png", "map.jpg"])
def test_noise_of_a_compression(tmp_path: Path, quality: int, name: str) -> None:
    packed = io.BytesIO()
    thick_sheet().save(packed, "JPEG", quality=quality)
    found = imported(tmp_path, Image.open(packed), said=thresholds(0.25), name=name)
    assert {direction for direction, _, _ in walls(found)} == {0, 180, 270}
    assert len(walls(found)) == 3
    assert found.map.segments.lengths.sum() == pytest.approx(80.0, abs=1.0)


@pytest.mark.parametrize("factor", [2, pytest.param(3, marks=LONG), pytest.param(4, marks=LONG)])
@pytest.mark.parametrize("filtered", [Image.Resampling.BILINEAR, Image.Resampling.LANCZOS])
def test_blurred_edges_of_a_resized_picture(tmp_path: Path, factor: int, filtered: Image.Resampling) -> None:
    small = thick_sheet()
    large = small.resize((small.width * factor, small.height * factor), filtered)
    found = imported(tmp_path, large, said=thresholds(0.25))
    # Where a wall ends, free, occupied and unknown blur into one another: pieces of a metre.
    long = {(direction, length) for direction, _, length in walls(found) if length > 2.0}
    assert long == {(0, 30.0 * factor), (180, 30.0 * factor), (270, 20.0 * factor)}


def test_gradients_follow_the_thresholds(tmp_path: Path) -> None:
    """Probabilities as grey values: 205 is one of them and no class of its own."""
    up = np.tile(np.linspace(255, 120, 300).astype(np.uint8), (200, 1))
    up[:20] = up[-20:] = 0
    found = imported(tmp_path, Image.fromarray(up))
    assert "unknown_grey" not in notes(found)
    # A few cells of the edges are decided.
    assert cells(found)[0] == pytest.approx(int((up > 205).sum()), abs=50)


@pytest.mark.parametrize(
    ("greys", "kind"), [((205, 205, 0), "free"), ((255, 255, 205), "occupied"), ((255, 255, 128), "occupied")]
)
def test_a_usual_value_that_is_lightest_or_darkest(tmp_path: Path, greys: tuple[int, int, int], kind: str) -> None:
    found = imported(tmp_path, Image.fromarray(shades(*greys)))
    assert walls(found) >= THREE_WALLS
    assert f"are the only ones that are {kind}" in notes(found)["unknown_grey"].message
    assert "option unknown" in notes(found)["unknown_grey"].message


def test_the_caller_says_which_cells_are_unknown(tmp_path: Path) -> None:
    picture = Image.fromarray(shades(255, 222, 0))
    found = imported(tmp_path, picture, ImportOptions(unknown=222), said=thresholds(0.4))
    assert is_the_hall(found)
    assert "unknown_grey" not in notes(found)
    free = imported(tmp_path, Image.fromarray(shades(254, 205, 0)), ImportOptions(unknown="none"))
    assert cells(free) == [420 * 640 - 802, 802, 0]
    for wrong in (256, -1, "grey", True):
        with pytest.raises(InvalidOptionError, match="unknown: expected none, or a grey value"):
            ImportOptions(unknown=wrong)  # type: ignore[arg-type]


def test_a_picture_without_walls_says_how_its_cells_were_taken(tmp_path: Path) -> None:
    up = sheet()
    up[up == WALL] = UNKNOWN
    up[10:14, 10:14] = WALL
    with pytest.raises(MalformedFileError, match="found 60000 free, 16 occupied, 208784 unknown cells"):
        imported(tmp_path, Image.fromarray(up))
