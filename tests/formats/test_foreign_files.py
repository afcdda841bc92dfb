"""Files of other tools that look like what is read and are not: refused with what to do, or used with a note."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from ezdxf.filemanagement import new
from PIL import Image

from formats import FormatError, ImportOptions, LogOptions, UnsupportedFormatError, read_log, read_map

from .reading import counts, feature, geojson, imported, notes, rows, saved, svg, written

METRES = ImportOptions(units="m", drawn="faces")
LINE = "<line x2='4' y2='0' stroke='black'/>"
GRID = "image: map.{}\nresolution: 0.05\norigin: [0, 0, 0]\n"


@pytest.mark.parametrize("name", ["a.dxf", "a.svg", "a.csv", "a.yaml", "a.txt", "a.log", "a.db3"])
@pytest.mark.parametrize(
    ("begin", "message"),
    [
        (b"\x1f\x8b\x08", "compressed with gzip; unpack it"),
        (b"PK\x03\x04", "ZIP archive"),
        (b"%PDF-1.7", "export the drawing as DXF or SVG"),
        (b"AC1032", "save it as DXF"),
        (b"ISO-10303-21;", "export the plan of a floor"),
        (b"version https://git-lfs.github.com/spec/v1\n", "git lfs pull"),
        (b"<!DOCTYPE html>", "download the file again"),
        (b"# .PCD v.7", "point cloud"),
        (b"\0\0\x27\x0a", "save it as GeoJSON"),
        (b"#ROSBAG V2.0\n", r"has to end in \.bag"),
        (b"\x89MCAP0\r\n", r"has to end in \.mcap"),
    ],
)
def test_the_content_of_another_format_is_named(tmp_path: Path, name: str, begin: bytes, message: str) -> None:
    read: Callable[[Path], object] = read_log if name.endswith((".log", ".db3")) else read_map
    with pytest.raises(UnsupportedFormatError, match=message):
        read(written(tmp_path, name, begin + b"more"))


@pytest.mark.parametrize(
    ("begin", "message"),
    [
        (b"version https://git-lfs.github.com/spec/v1\n", "git lfs pull"),
        (b"P5\r\n4 4\r\n255\r\n" + bytes(16), "transferred as text"),
        (b"P5\n# by map_saver\n4 4\n255\r\n" + bytes(17), "transferred as text"),
    ],
)
def test_pictures_that_a_transfer_has_changed(tmp_path: Path, begin: bytes, message: str) -> None:
    written(tmp_path, "map.pgm", begin)
    with pytest.raises(FormatError, match=rf"map\.pgm: .*{message}"):
        read_map(written(tmp_path, "a.yaml", GRID.format("pgm")))


def test_coloured_and_transparent_cells_of_a_grid_are_said(tmp_path: Path) -> None:
    cells = np.zeros((40, 60, 4), np.uint8)
    cells[..., 3] = 255
    cells[5:35, 5:55, :3] = 254
    cells[10:20, 10:20, :3] = 255, 0, 0
    cells[:2, :, 3] = 254
    Image.fromarray(cells, "RGBA").save(tmp_path / "map.png")
    found = counts(read_map(written(tmp_path, "a.yaml", GRID.format("png"))), "assumed")
    assert (found["coloured"], found["transparent"]) == (100, 120)


def test_another_yaml_file_is_named_by_its_keys(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"no image and no resolution and no origin.*; found map_server"):
        read_map(written(tmp_path, "a.yaml", "map_server:\n  ros__parameters: {}\n"))


@pytest.mark.parametrize("comment", ["# x1 x2 y1 y2\n", "% x1,x2,y1,y2\n", "# by a tool\n#x1 x2 y1 y2\n"])
def test_names_of_columns_in_a_comment_hold(tmp_path: Path, comment: str) -> None:
    delimiter = "," if "," in comment else " "
    found = read_map(written(tmp_path, "a.csv", comment + delimiter.join("0400")), METRES)
    assert rows(found) == [[0, 0, 4, 0]]
    assert "columns" not in notes(found)


def test_rows_that_are_longer_than_their_header_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"line 2: has 8 columns of numbers .*, expected 4"):
        read_map(written(tmp_path, "a.csv", "x1,y1,x2,y2\n1,5,2,5,7,5,2,5\n"))


def test_an_unlikely_unit_of_a_table_is_said(tmp_path: Path) -> None:
    found = notes(read_map(written(tmp_path, "a.csv", "0,0,4000,0\n0,0,0,3000\n")))
    assert "in mm it is 4 m" in found["unlikely_unit"].message
    assert "columns" in found
    assert "as is usual in a table" in found["unit"].message


def entities(*lines: str) -> bytes:
    text = "".join(f"  0\nLINE\n  8\n0\n 10\n0\n 20\n{y}\n 11\n4\n 21\n{y}\n" for y in lines)
    return f"  0\nSECTION\n  2\nENTITIES\n{text}  0\nENDSEC\n  0\nEOF\n".encode()


def test_numbers_of_a_dxf_that_cannot_be_read_are_not_repaired(tmp_path: Path) -> None:
    assert rows(read_map(written(tmp_path, "a.dxf", entities("2.5")), METRES)) == [[0, 2.5, 4, 2.5]]
    with pytest.raises(FormatError, match=r'expected decimal points: .*"2,5"'):
        read_map(written(tmp_path, "a.dxf", entities("2,5")), METRES)


def test_a_dxf_that_is_cut_off_is_said(tmp_path: Path) -> None:
    whole = entities("0", "1", "2")
    assert "cut_off" not in notes(read_map(written(tmp_path, "a.dxf", whole), METRES))
    assert "cut_off" in notes(read_map(written(tmp_path, "a.dxf", whole[:-8]), METRES))
    with pytest.raises(FormatError, match="cut off"):
        read_map(written(tmp_path, "a.dxf", whole[: len(whole) // 2]), METRES)


def test_lines_with_gaps_are_no_walls_whatever_their_name(tmp_path: Path) -> None:
    document = new("R2010", units=6)
    document.linetypes.add("AXES", [3.0, 2.0, -0.25, 0.5, -0.25])
    document.linetypes.add("WALL", [1.0, 1.0])
    for y, linetype in enumerate(("AXES", "WALL", "CONTINUOUS")):
        document.modelspace().add_line((0, y), (4, y), dxfattribs={"linetype": linetype})
    found = imported(saved(tmp_path, document), drawn="faces")
    assert rows(found) == [[0, 1, 4, 1], [0, 2, 4, 2]]
    assert "AXES" in notes(found)["not_seen"].message


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        ("<g transform='translate(1-2)'>{}</g>", [[1, 2, 5, 2]]),
        ("<g transform='translate(1 -2)scale(2)'>{}</g>", [[1, 2, 9, 2]]),
        ("<g style='translate: 1px 2px; scale: 50%; rotate: z 180deg'>{}</g>", [[1, -2, -1, -2]]),
        ("{}<rect width='-3' height='2' stroke='black'/>", [[0, 0, 4, 0]]),
        ("{}<rect width='3' height='2' fill='none' stroke='rgb(0 0 0 / 0)'/>", [[0, 0, 4, 0]]),
        ("{}<line x2='3' y2='3' stroke='#0000'/>", [[0, 0, 4, 0]]),
        ("{}<line x2='3' y2='3' stroke='black' stroke-width='0px'/>", [[0, 0, 4, 0]]),
        ("<g stroke-width='0'><g stroke-width='1'>{}</g><path d='M0 0 4 4' fill='none'/></g>", [[0, 0, 4, 0]]),
    ],
)
def test_shapes_of_an_svg_where_a_browser_draws_them(tmp_path: Path, shape: str, expected: list[list[float]]) -> None:
    assert rows(read_map(svg(tmp_path, shape.format(LINE)), METRES)) == [pytest.approx(row) for row in expected]


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        ("<g transform='translate(1 2'>{}</g>", "has a transform that cannot be read"),
        ("<g transform='1 2'>{}</g>", "has a transform that cannot be read"),
        ("<g transform='rotate(1 2 3 4)'>{}</g>", "has a transform that cannot be read"),
        ("<g style='transform: translate(calc(1px), 2px)'>{}</g>", "has a transform that cannot be read"),
        ("<polyline points='0 0 4 0 4' stroke='black'/>", "points of a polyline element is 'a list of 5'"),
    ],
)
def test_shapes_of_an_svg_that_are_not_clear_are_refused(tmp_path: Path, shape: str, message: str) -> None:
    with pytest.raises(FormatError, match=message):
        read_map(svg(tmp_path, shape.format(LINE)), METRES)


@pytest.mark.parametrize(
    ("body", "count"),
    [
        (LINE, 0),
        (LINE + "<line x1='8' x2='12' stroke='black'/>", 1),
        (f"<svg x='1' y='1' width='3' height='3'>{LINE}</svg>", 1),
        (f"<symbol id='s' viewBox='0 0 4 4'>{LINE}</symbol><use href='#s' width='3' height='3'/>", 0),
    ],
)
def test_lines_beyond_the_picture_of_an_svg_are_said(tmp_path: Path, body: str, count: int) -> None:
    assert counts(read_map(svg(tmp_path, body), METRES)).get("outside", 0) == count


def test_the_crs_of_a_feature_holds(tmp_path: Path) -> None:
    one = feature([[0, 0], [900, 0]]) | {"crs": {"type": "name", "properties": {"name": "EPSG:2263"}}}
    with pytest.raises(FormatError, match="EPSG:2263, which is in feet"):
        imported(geojson(tmp_path, one), local_metres=True)


@pytest.mark.parametrize(("root", "message"), [({"walls": []}, "an object with walls"), ({"segments": None}, "null")])
def test_json_of_another_tool_is_named_by_its_fields(tmp_path: Path, root: object, message: str) -> None:
    with pytest.raises(FormatError, match=message):
        read_map(written(tmp_path, "a.json", json.dumps(root)))


RANGES = "1 1.5 2 2.5 3"
ROBOT = "ROBOTLASER1 0 -1 2 {step} 30 0 0 5 " + RANGES + " 0 1 1 0 1 1 0 0 0 0 0 0 5.0 host 5.0\n"


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (f"FLASER 4 {RANGES} 1 1 0 1 1 0 5.0 host 5.0\n", "check the number of its ranges"),  # one less than there are
        (f"FLASER 5 {RANGES.replace('.', ',')} 1 1 0 1 1 0 5.0 host 5.0\n", "and decimal points"),
        (ROBOT.format(step=0.1), "contradict each other"),  # two radians in all, by its third number
    ],
)
def test_messages_of_carmen_that_contradict_themselves(tmp_path: Path, line: str, message: str) -> None:
    with pytest.raises(FormatError, match=message):
        list(read_log(written(tmp_path, "a.log", line)))


def test_doubts_about_a_log_of_carmen_are_said(tmp_path: Path) -> None:
    assert len(list(read_log(written(tmp_path, "a.log", ROBOT.format(step=0.5))))) == 1
    far = read_log(written(tmp_path, "far.log", "FLASER 3 1000 1500 2000 1 1 0 1 1 0 5.0 host 5.0\n"))
    raw = read_log(
        written(tmp_path, "raw.log", f"RAWLASER1 0 -1 2 0.5 30 0 0 5 {RANGES} 0 5.0 host 5.0\n"), LogOptions()
    )
    assert (len(list(far)), len(list(raw))) == (1, 1)
    assert "no_range_within" in notes(far)
    assert "RAWLASER1 messages have no pose" in notes(raw)["no_odometry"].message
