"""Grids of map_server: pictures drawn by Pillow, walls where they were drawn."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from formats import (
    FormatError,
    ImportedMap,
    ImportOptions,
    IncompleteFileError,
    MalformedFileError,
    TooLargeError,
    UnsupportedFormatError,
    read_map,
)
from registration import wrap_angle

from .reading import counts, notes

FREE, UNKNOWN, WALL = 254, 205, 0
YAML = "image: {image}\nresolution: 0.05\norigin: [{origin}]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"

Pixels = NDArray[np.uint8]


def l_room() -> Pixels:
    """A room of 4 m by 3 m whose upper right quarter (2 m by 1 m) is cut off; walls of one cell; y up, row 0 lowest."""
    grid = np.full((80, 100), UNKNOWN, dtype=np.uint8)
    grid[9:71, 9:91] = WALL
    grid[10:70, 10:90] = FREE
    grid[49:71, 49:91] = UNKNOWN
    grid[49, 49:91] = WALL
    grid[49:71, 49] = WALL
    return grid


def write(folder: Path, up: Pixels, yaml: str = YAML, origin: str = "0, 0, 0", name: str = "map.pgm") -> Path:
    Image.fromarray(up[::-1]).save(folder / name)
    path = folder / "map.yaml"
    path.write_text(yaml.format(image=name, origin=origin))
    return path


def walls(imported: ImportedMap) -> set[tuple[int, float, float]]:
    """Direction in whole degrees, signed offset to 5 mm and length to half a metre, of the long walls."""
    s = imported.map.segments
    angles = np.rint(np.degrees(np.arctan2(s.directions[:, 1], s.directions[:, 0]))).astype(int) % 360
    rounded = zip(angles, np.round(s.offsets / 0.005) * 0.005, s.lengths, strict=True)
    return {(int(a), round(float(o), 3), round(2 * float(n)) / 2) for a, o, n in rounded if n > 0.5}


# Walls lie in the middle of their cell: the cell from 0.45 to 0.50 m at 0.475. Free space on the left: the lower wall
# runs along +x, its normal is +y and its offset +0.475; the upper one runs along -x at y = 3.525, offset -3.525.
L_ROOM = {
    (0, 0.475, 4.0), (90, -4.525, 2.0), (180, -2.475, 2.0), (90, -2.475, 1.0), (180, -3.525, 2.0), (270, 0.475, 3.0),
}  # fmt: skip


@pytest.mark.parametrize("name", ["map.pgm", "map.png", "map.bmp"])
def test_walls_lie_in_the_middle_of_their_cells_with_free_space_on_the_left(tmp_path: Path, name: str) -> None:
    imported = read_map(write(tmp_path, l_room(), name=name))
    assert walls(imported) == L_ROOM
    assert imported.map.oriented
    assert imported.map.sigma == pytest.approx(0.025)
    assert (imported.report.format, imported.report.files) == ("map_server", ("map.yaml", name))
    # Occupied is each wall as long as that of the room that it was cut from.
    assert counts(imported, "read").items() >= {
        "free_cells": 80 * 60 - 41 * 21, "occupied_cells": 2 * 82 + 2 * 60, "segments": 6,
    }.items()  # fmt: skip


def test_the_origin_moves_and_turns_the_map(tmp_path: Path) -> None:
    straight = read_map(write(tmp_path, l_room())).map.segments
    turned = read_map(write(tmp_path, l_room(), origin="692000.25, 5336000.5, 0.5")).map.segments
    c, s = math.cos(0.5), math.sin(0.5)
    x, y = straight.midpoints.T
    expected = np.stack([692000.25 + c * x - s * y, 5336000.5 + s * x + c * y], axis=1)
    np.testing.assert_allclose(turned.midpoints, expected, rtol=0.0, atol=1e-8)
    gain = np.arctan2(turned.directions[:, 1], turned.directions[:, 0])
    gain -= np.arctan2(straight.directions[:, 1], straight.directions[:, 0])
    np.testing.assert_allclose([wrap_angle(g - 0.5) for g in gain], 0.0, atol=1e-9)


def percent(up: Pixels) -> Pixels:
    """As map_saver writes mode raw: occupancy in percent, 255 unknown."""
    return np.choose(np.searchsorted([WALL, UNKNOWN, FREE], up), [np.uint8(100), np.uint8(255), np.uint8(0)])


def grey(up: Pixels) -> Pixels:
    """As the public intel grid: 255 free, 230 unknown, walls no darker than 127, thresholds that fit none of it."""
    return np.choose(np.searchsorted([WALL, UNKNOWN, FREE], up), [np.uint8(127), np.uint8(230), np.uint8(255)])


@pytest.mark.parametrize(("drawn", "more"), [(percent, "mode: raw\n"), (grey, "")])
def test_other_ways_to_draw_it_give_these_walls(tmp_path: Path, drawn: Callable[[Pixels], Pixels], more: str) -> None:
    imported = read_map(write(tmp_path, drawn(l_room()), YAML + more, name="map.png"))
    assert walls(imported) == L_ROOM
    assert ("thresholds" in notes(imported)) == (drawn is grey)


def room_of(back: NDArray[np.int64]) -> Pixels:
    """Return a room of 4 m by 3 m from 0.5 m on, with walls of some cells, which repeat along each wall."""
    grid = np.full((80, 100), UNKNOWN, dtype=np.uint8)
    for k in range(100):
        most = int(back[k % len(back)])
        row, column = min(max(k, 10), 69), min(max(k, 10), 89)
        grid[10 - most : 70 + most, column] = WALL
        grid[row, 10 - most : 90 + most] = WALL
    grid[10:70, 10:90] = FREE
    return grid


AT_FRONT = {(0, 0.5, 4.0), (90, -4.5, 3.0), (180, -3.5, 4.0), (270, 0.5, 3.0)}
BEHIND = {(0, 0.4, 4.0), (90, -4.6, 3.0), (180, -3.6, 4.0), (270, 0.4, 3.0)}  # by 2 cells


@pytest.mark.parametrize(
    ("back", "surface", "expected", "said"),
    [
        ([6], None, AT_FRONT, "as in a drawn grid"),
        ([3], None, AT_FRONT, "as in a drawn grid"),
        ([2], None, AT_FRONT, "as in a drawn grid"),
        ([6, 9, 4, 6, 3, 8, 6], None, BEHIND, "as in a mapped grid"),  # six cells: a third of them
        ([6], 2.0, BEHIND, "as an option states"),
    ],
)
def test_the_surface_of_thick_walls(
    tmp_path: Path, back: list[int], surface: float | None, expected: set[tuple[int, float, float]], said: str
) -> None:
    imported = read_map(write(tmp_path, room_of(np.array(back))), ImportOptions(surface=surface))
    assert walls(imported) == expected
    assert said in notes(imported)["surface"].message


@pytest.mark.parametrize(
    ("yaml", "kind", "message"),
    [
        ("image: [", MalformedFileError, "is not YAML"),
        ("- 1", MalformedFileError, "expected a YAML mapping"),
        ("!!python/object/apply:os.system ['true']", MalformedFileError, "is not YAML"),
        ("image: map.pgm\norigin: [0, 0, 0]", IncompleteFileError, "has no resolution"),
        (YAML.replace("0.05", "-1"), MalformedFileError, "expected resolution to be a number from 0.001 to 10"),
        (YAML.replace("0.05", ".nan"), MalformedFileError, "expected resolution"),
        (YAML.replace("[{origin}]", "[0, .inf, 0]"), MalformedFileError, "expected origin"),
        (YAML.replace("{image}", "nothing.pgm"), IncompleteFileError, "nothing.pgm, but there is no such file"),
        (YAML.replace("{image}", "map.yaml"), MalformedFileError, "is not a picture"),
        ("[" * 3_000, MalformedFileError, "is not YAML of a map: expected at most 64 nested lists, found 3000"),
        ("#" * 17_000, TooLargeError, "at most 16384 bytes"),
        (YAML.replace("{origin}", "0, 0, 90"), MalformedFileError, "found 90; if these are degrees, write 1.5708"),
        (YAML.replace("{origin}", "nan, 0, 0"), MalformedFileError, "expected origin to be"),
        (YAML.replace("negate: 0", "negate: 0\nnegate: 1"), MalformedFileError, 'line 5: found duplicate key "negate"'),
        (YAML.replace("negate: 0", "negate: [0"), MalformedFileError, "is not YAML: line 5"),
        (YAML.replace("0.65\nfree_thresh: 0.196", "0.196\nfree_thresh: 0.65"), MalformedFileError, "exchange them"),
    ],
)
def test_bad_descriptions_are_refused(tmp_path: Path, yaml: str, kind: type[FormatError], message: str) -> None:
    path = write(tmp_path, l_room())
    path.write_text(yaml.replace("{image}", "map.pgm").replace("{origin}", "0, 0, 0"))
    with pytest.raises(kind) as caught:
        read_map(path)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_picture_is_looked_for_beside_its_description_alone(tmp_path: Path) -> None:
    inner = tmp_path / "inner"
    inner.mkdir()
    text = write(tmp_path, l_room()).read_text()
    (inner / "map.yaml").write_text(text.replace("map.pgm", "../map.pgm"))
    with pytest.raises(IncompleteFileError, match="no such file"):
        read_map(inner / "map.yaml")


@pytest.mark.parametrize("image", ["pictures/map.pgm", "./pictures/map.pgm", "pictures\\map.pgm"])
def test_a_picture_may_be_in_a_folder_below(tmp_path: Path, image: str) -> None:
    path = write(tmp_path, l_room())
    expected = walls(read_map(path))
    path.write_text(path.read_text().replace("map.pgm", image))
    (tmp_path / "pictures").mkdir()
    (tmp_path / "map.pgm").rename(tmp_path / "pictures" / "map.pgm")
    assert walls(read_map(path)) == expected


@pytest.mark.parametrize(
    ("content", "kind", "message"),
    [
        (b"P5 7000 7000 255\n", TooLargeError, "at most 40000000 pixels"),
        (b"P5 70 70 255\n" + bytes(100), MalformedFileError, "broken picture"),
    ],
)
def test_pictures_that_are_too_large_or_cut_off_are_refused(
    tmp_path: Path, content: bytes, kind: type[FormatError], message: str
) -> None:
    path = write(tmp_path, l_room())
    (tmp_path / "map.pgm").write_bytes(content)
    with pytest.raises(kind, match=message):
        read_map(path)


@pytest.mark.parametrize("share", [0.05, 0.5])
def test_a_picture_of_noise_is_refused(tmp_path: Path, share: float) -> None:
    """Each of its borders would take a third of a millisecond; rooms have far fewer."""
    occupied = np.random.default_rng(1).random((400, 400)) < share
    with pytest.raises(TooLargeError, match=r"at most 5000 borders of free cells, one in 60 cells.* remove noise"):
        read_map(write(tmp_path, np.where(occupied, WALL, FREE).astype(np.uint8)))


def with_posts(up: Pixels) -> Pixels:
    """Stand a table of four legs, of one cell each, and a box of two by two cells in the room; one speck outside."""
    for row, column in ((20, 20), (20, 30), (26, 20), (26, 30)):
        up[row, column] = WALL
    up[55:57, 20:22] = WALL
    up[75, 95] = WALL
    return up


def test_cells_that_are_too_few_for_a_wall_are_points(tmp_path: Path) -> None:
    imported = read_map(write(tmp_path, with_posts(l_room()), origin="1.0, -2.0, 0"))
    line_map, expected = imported.map, {(20, 20), (20, 30), (26, 20), (26, 30), (55, 20), (55, 21), (56, 20), (56, 21)}
    assert walls(read_map(write(tmp_path, with_posts(l_room())))) == L_ROOM
    middles = {(round((y + 2.0) / 0.05 - 0.5), round((x - 1.0) / 0.05 - 0.5)) for x, y in line_map.points.tolist()}
    assert middles == expected
    assert line_map.points_sigma == line_map.sigma == 0.025
    assert counts(imported)["points"] == 8


def test_walls_leave_no_points(tmp_path: Path) -> None:
    """Also those that are not along the grid, and thick ones."""
    assert len(read_map(write(tmp_path, l_room())).map.points) == 0
    y, x = np.mgrid[0:200, 0:200] - 100.0
    turned = np.abs(np.stack([0.9 * x + 0.436 * y, -0.436 * x + 0.9 * y])).max(axis=0)
    grid = np.full((200, 200), UNKNOWN, dtype=np.uint8)
    grid[turned < 83] = WALL
    grid[turned < 80] = FREE
    assert len(read_map(write(tmp_path, grid)).map.points) <= 8, "at the corners"


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("{origin}", "0, 0, -nan"),
        ("{origin}", "0, 0, nan"),
        ("{origin}", "0, 0, .nan"),
        ("{origin}", "0, 0, -.nan"),
        ("{origin}", "0, 0, -nan(ind)"),
        ("{origin}", "0, 0, 6.2832"),
        ("{origin}", '"0", "0", "0"'),
        ("resolution: 0.05", 'resolution: "0.05"'),
        ("negate: 0", "negate: no"),
        ("negate: 0", "negate:\t0"),
        ("negate: 0", "negate: '0'\nmode: Trinary"),
    ],
)
def test_descriptions_as_people_and_tools_write_them(tmp_path: Path, old: str, new: str) -> None:
    assert old in YAML
    imported = read_map(write(tmp_path, l_room(), YAML.replace(old, new)))
    assert walls(imported) == L_ROOM
    assert ("orientation" in notes(imported)) == ("nan" in new)


@pytest.mark.parametrize("kind", ["TIFF", "GIF", "WebP"])
def test_pictures_of_another_kind_are_named(tmp_path: Path, kind: str) -> None:
    path = write(tmp_path, l_room())
    Image.fromarray(l_room()).save(tmp_path / "map.pgm", format=kind)
    with pytest.raises(UnsupportedFormatError, match=f"is a {kind}; save it as PNG"):
        read_map(path)


def test_doubtful_pictures_and_resolutions_are_said(tmp_path: Path) -> None:
    coarse = YAML.replace("resolution: 0.05", "resolution: 5")
    assert "resolution" in notes(read_map(write(tmp_path, l_room(), coarse)))
    inverted = np.full((60, 80), 255, np.uint8)
    inverted[[10, 40], 10:60] = inverted[10:40, [10, 59]] = 254
    found = read_map(write(tmp_path, np.where(inverted == 254, 255, 0).astype(np.uint8)))
    assert "set negate to 1" in notes(found)["inverted"].message
