"""Written files are read back unchanged; pictures show walls and their free sides."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from formats import LineMap, StampedPose, UnsupportedFormatError, draw_map, read_map, write_map, write_tum
from formats.picture import DrawnLines, DrawnText
from registration import RigidTransform, Segments


@pytest.mark.parametrize("oriented", [True, False])
@pytest.mark.parametrize("suffix", ["json", "geojson", "svg", "csv", "dxf"])
def test_a_map_comes_back_to_the_bit(tmp_path: Path, suffix: str, oriented: bool) -> None:
    corners = [[1.5, 2.5, 4.25, 0.75], [0.1, 1 / 3, -7e3, 2e3]]
    written = LineMap(Segments.from_array(corners), 0.04, oriented, "hall", {"source": "drawn"})
    path = tmp_path / f"map.{suffix}"
    write_map(written, path)
    again = read_map(path).map
    assert again.segments.endpoints.tolist() == corners
    assert again.oriented is oriented
    if suffix == "json":
        assert (again.sigma, again.frame_id, again.meta) == (0.04, "hall", {"source": "drawn"})


def test_names_in_a_map_cannot_break_out_of_an_svg(tmp_path: Path) -> None:
    path = tmp_path / "map.svg"
    write_map(LineMap(Segments.from_array([[0, 0, 1, 0]]), frame_id='"><script>alert(1)</script>'), path)
    assert b"<script" not in path.read_bytes()
    assert len(read_map(path).map.segments) == 1


def test_other_formats_are_not_written(tmp_path: Path) -> None:
    one = LineMap(Segments.from_array([[0, 0, 1, 0]]))
    with pytest.raises(UnsupportedFormatError, match="ends in one of"):
        write_map(one, tmp_path / "map.dwg")
    with pytest.raises(UnsupportedFormatError, match=r"\.png"):
        draw_map(one, tmp_path / "map.jpg")


def test_a_picture_shows_walls_free_sides_and_poses(tmp_path: Path) -> None:
    room = Segments.from_array([[0, 0, 2, 0], [2, 0, 2, 2], [2, 2, 0, 2], [0, 2, 0, 0]])
    draw_map(LineMap(room), tmp_path / "a.png", [RigidTransform(1.0, 1.0, 0.0)])
    pixels = np.asarray(Image.open(tmp_path / "a.png")).astype(int)
    assert pixels.shape == (1660, 1600, 3)
    plan, strip = pixels[:1600], pixels[1600:]
    rows, columns = np.nonzero((plan == (42, 160, 224)).all(axis=2))
    # Ticks point into the room, 20 pixels from the border; none lies outside of its walls.
    assert rows.min() >= 20
    assert rows.max() <= 1580
    assert ((np.abs(rows - 800) < 5) | (np.abs(columns - 800) < 5)).all()
    assert tuple(pixels[800, 800]) == (0, 158, 115)
    # The legend names what is drawn; a bar of 20 cm is 156 pixels long.
    for colour, there in (((0, 158, 115), True), ((42, 160, 224), True), ((142, 152, 163), False)):
        assert (strip == colour).all(axis=2).any() == there
    assert (strip[30] == (16, 20, 24)).all(axis=1)[20:176].all()
    assert not (strip[30] == (16, 20, 24)).all(axis=1)[180]
    draw_map(LineMap(room, oriented=False), tmp_path / "b.png")
    assert not (np.asarray(Image.open(tmp_path / "b.png")) == (42, 160, 224)).all(axis=2).any()


def test_texts_at_one_place_are_below_each_other_and_dashes_are_so_in_the_legend(tmp_path: Path) -> None:
    room = LineMap(Segments.from_array([[0, 0, 2, 0], [2, 0, 2, 2], [2, 2, 0, 2], [0, 2, 0, 0]]))
    colours = [(200, 0, 0), (0, 0, 200)]
    lines = [DrawnLines(np.array([[0.5, 0.2, 1.5, 0.2]]), (0, 90, 0), "old", dashed=True)]
    draw_map(room, tmp_path / "a.png", lines=lines, texts=[DrawnText(1.0, 1.0, "8", colour) for colour in colours])
    pixels = np.asarray(Image.open(tmp_path / "a.png"))
    first, second = (np.nonzero((pixels == colour).all(axis=2))[0] for colour in colours)
    assert first.min() < 800 < first.max() < second.min()
    swatch = np.nonzero((pixels[1630] == (0, 90, 0)).all(axis=1))[0]
    assert (np.diff(swatch) > 1).sum() == 1


def test_tum_has_a_line_a_pose_with_the_time_to_the_nanosecond(tmp_path: Path) -> None:
    poses = [StampedPose(1_700_000_000_000_000_005, RigidTransform(1.5, -2.25, math.pi / 2))]
    assert write_tum(poses, tmp_path / "a.tum") == 1
    half = f"{math.sqrt(0.5):.12f}"
    text = (tmp_path / "a.tum").read_text()
    assert text == f"1700000000.000000005 1.500000000 -2.250000000 0 0 0 {half} {half}\n"
