"""Drawings made by ezdxf and by hand: units, blocks, curves, faces, directions; written maps and pictures."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from ezdxf import units
from ezdxf.filemanagement import new
from PIL import Image

from formats import (
    ImportedMap,
    ImportOptions,
    IncompleteFileError,
    InvalidOptionError,
    LineMap,
    StampedPose,
    TooLargeError,
    UnsupportedFormatError,
    draw_map,
    read_map,
    write_map,
    write_tum,
)
from formats.picture import DrawnLines, DrawnText
from registration import RigidTransform, Segments

from .reading import counts, feature, geojson, notes, rows, saved, svg, written

SQUARE = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)]
AROUND = [[0, 0, 4, 0], [4, 0, 4, 3], [4, 3, 0, 3], [0, 3, 0, 0]]
COPIES = {"row_count": 30_000, "column_count": 30_000, "row_spacing": 1, "column_spacing": 1}


def test_the_unit_of_a_dxf_is_its_own_or_the_callers(tmp_path: Path) -> None:
    document = new(units=units.MM)
    document.modelspace().add_lwpolyline([(1e3 * x, 1e3 * y) for x, y in SQUARE], close=True)
    assert rows(read_map(saved(tmp_path, document))) == AROUND
    document.header["$INSUNITS"] = 0
    with pytest.raises(IncompleteFileError, match="set the option units"):
        read_map(saved(tmp_path, document))
    assert rows(read_map(saved(tmp_path, document), ImportOptions(units="mm"))) == AROUND
    assert rows(read_map(saved(tmp_path, document), ImportOptions(units=0.001))) == AROUND


def test_blocks_are_taken_apart_where_they_stand(tmp_path: Path) -> None:
    document = new(units=units.M)
    inner = document.blocks.new("WALL")
    inner.add_line((0, 0), (2, 0))
    outer = document.blocks.new("TWO")
    outer.add_blockref("WALL", (0, 0))
    outer.add_blockref("WALL", (0, 1))
    document.modelspace().add_blockref("TWO", (10, 20), dxfattribs={"rotation": 90})
    document.blocks.new("A-Door 90").add_line((0, 0), (1, 0))  # an open leaf
    document.modelspace().add_blockref("A-Door 90", (0, 0))
    # Turned by a quarter: (x, y) becomes (10 - y, 20 + x).
    assert rows(read_map(saved(tmp_path, document))) == [[10, 20, 10, 22], [9, 20, 9, 22]]


def test_arcs_become_chords_within_a_centimetre_and_text_is_dropped(tmp_path: Path) -> None:
    document = new(units=units.M)
    document.modelspace().add_arc((0, 0), radius=5, start_angle=0, end_angle=90)
    document.modelspace().add_text("Hall")
    imported = read_map(saved(tmp_path, document))
    segments = imported.map.segments
    assert segments.lengths.sum() == pytest.approx(2.5 * math.pi, rel=2e-3)
    assert np.hypot(*segments.midpoints.T).min() > 5 - 0.01
    assert counts(imported)["entity_text"] == 1


def test_a_block_in_itself_and_too_many_copies_are_refused(tmp_path: Path) -> None:
    document = new(units=units.M)
    for k in range(12):
        block = document.blocks.new(f"B{k}")
        for _ in range(10):
            block.add_blockref(f"B{k + 1}", (0, 0))
    document.blocks.new("B12").add_line((0, 0), (1, 0))
    document.modelspace().add_blockref("B0", (0, 0))
    with pytest.raises(TooLargeError, match="8 blocks in one another"):
        read_map(saved(tmp_path, document))
    many = new(units=units.M)
    many.blocks.new("E")
    many.modelspace().add_blockref("E", (0, 0), dxfattribs=COPIES)
    with pytest.raises(TooLargeError, match="copies of a block"):
        read_map(saved(tmp_path, many))


def test_an_svg_is_read_upright_with_its_transforms(tmp_path: Path) -> None:
    body = (
        '<g id="walls" transform="translate(10 0)"><g transform="scale(2)"><line x1="0" y1="0" x2="1" y2="2"/></g></g>'
        '<rect x="0" y="0" width="4" height="3"/><path d="M0 5h2v1z"/><polyline points="0,7 1,7 1,8"/>'
        '<defs><line x1="0" y1="0" x2="9" y2="9"/></defs><text>Hall</text>'
        '<line style="display: none" x1="0" y1="0" x2="5" y2="5"/>'
    )
    imported = read_map(svg(tmp_path, body), ImportOptions(units="m"))
    assert rows(imported) == [
        [10, 0, 12, -4],
        [0, 0, 4, 0], [4, 0, 4, -3], [4, -3, 0, -3], [0, -3, 0, 0],
        [0, -5, 2, -5], [2, -5, 2, -6], [2, -6, 0, -5],
        [0, -7, 1, -7], [1, -7, 1, -8],
    ]  # fmt: skip
    assert counts(imported)["hidden"] == 1
    chosen = read_map(svg(tmp_path, body), ImportOptions(units="cm", layers=("WALL*",)))
    assert rows(chosen) == [[0.1, 0.0, 0.12, -0.04]]


def test_curves_of_an_svg_become_chords(tmp_path: Path) -> None:
    body = '<path d="M5 0 A5 5 0 0 1 0 5"/>'
    segments = read_map(svg(tmp_path, body), ImportOptions(units="m")).map.segments
    # Sixteen chords of a quarter of a circle with radius 5.
    np.testing.assert_allclose(segments.lengths, 2 * 5 * math.sin(math.pi / 64), rtol=1e-6)


def test_geojson_is_read_as_metres_by_an_explicit_flag_alone(tmp_path: Path) -> None:
    path = geojson(
        tmp_path,
        feature([[*SQUARE, SQUARE[0]]], "Polygon", layer="wall"),
        feature([[[9, 0], [9, 1, 7]]], "MultiLineString", layer="wall"),
        feature([[0, 0], [1, 1]], layer="furniture"),
        feature([1, 1], "Point", layer="wall"),
    )
    with pytest.raises(IncompleteFileError, match="degrees"):
        read_map(path)
    imported = read_map(path, ImportOptions(local_metres=True, layers=("wall",)))
    assert rows(imported) == [*AROUND, [9, 0, 9, 1]]
    assert not imported.map.oriented
    assert counts(imported)["entity_point"] == 1


def test_lines_drawn_twice_are_merged_and_specks_dropped(tmp_path: Path) -> None:
    imported = read_map(written(tmp_path, "a.csv", "0,0,4,0\n4,0,0,0\n0,0,4,0\n1,1,1,1.001\n"))
    assert rows(imported) == [[0, 0, 4, 0]]
    read = {"unit": 0, "segments": 1, "columns": 0}
    assert counts(imported) == read | {"doubles": 2, "short": 1, "directions": 0}


def test_centre_lines_become_two_faces_apart_by_the_thickness(tmp_path: Path) -> None:
    path = written(tmp_path, "a.csv", "x1,y1,x2,y2\n0,0,4,0\n")
    imported = read_map(path, ImportOptions(drawn="centres", thickness=0.2))
    # Free space on the left of each: the upper face runs along +x, the lower one back, and both ends are closed.
    assert rows(imported) == [[0, 0.1, 4, 0.1], [4, -0.1, 0, -0.1], [0, -0.1, 0, 0.1], [4, 0.1, 4, -0.1]]
    assert imported.map.oriented
    assert assumed(imported) == ["thickness_given"]


def test_directions_are_found_from_a_place_inside(tmp_path: Path) -> None:
    # A room drawn without regard to direction within the outline of its walls, 0.3 m thick, and a partition.
    inner = "0,0,4,0\n4,3,4,0\n4,3,0,3\n0,0,0,3\n"
    outer = "-0.3,-0.3,4.3,-0.3\n4.3,-0.3,4.3,3.3\n4.3,3.3,-0.3,3.3\n-0.3,3.3,-0.3,-0.3\n"
    path = written(tmp_path, "a.csv", inner + outer + "2,0,2,2\n")
    imported = read_map(path, ImportOptions(point=((1.0, 1.0),)))
    assert imported.map.oriented
    found = {tuple(row) for row in rows(imported)}
    assert {(0, 0, 4, 0), (4, 0, 4, 3), (4, 3, 0, 3), (0, 3, 0, 0), (2, 0, 2, 2), (2, 2, 2, 0)} <= found
    assert len(found) == 6 + 2 * 4  # the outline cannot be reached: both directions
    assert counts(imported)["not_reached"] == 4
    with pytest.raises(InvalidOptionError, match=r"point\[1\]: lies on a line or outside"):
        read_map(path, ImportOptions(point=((1.0, 1.0), (50.0, 1.0))))


def test_directions_mean_what_the_caller_says(tmp_path: Path) -> None:
    path = written(tmp_path, "a.csv", "0,0,4,0\n")
    assert not read_map(path).map.oriented
    assert read_map(path, ImportOptions(oriented=True)).map.oriented
    path = written(
        tmp_path, "a.json", '{"segments": [[0, 0, 4, 0]], "sigma": 0.03, "frame_id": "hq", "meta": {"a": "b"}}'
    )
    own = read_map(path).map
    assert (own.oriented, own.sigma, own.frame_id, own.meta) == (True, 0.03, "hq", {"a": "b"})
    assert not read_map(path, ImportOptions(oriented=False)).map.oriented


@pytest.mark.parametrize(
    "wrong",
    [{"units": "furlong"}, {"units": 0.0}, {"thickness": -1.0}, {"point": ((math.nan, 0.0),)}, {"drawn": "both"}],
)
def test_options_out_of_range_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(InvalidOptionError):
        ImportOptions(**wrong)  # type: ignore[arg-type]


# A house of three rooms: its outline, a wall across with a door in it, and one from the outline to that.
OUTLINE = [[0, 0, 8, 0], [8, 0, 8, 6], [8, 6, 0, 6], [0, 6, 0, 0]]
INNER = [[0, 3, 3, 3], [4, 3, 8, 3], [5, 3, 5, 6]]
HOUSE = [*OUTLINE, *INNER]


Lines = Sequence[Sequence[float]]


def csv(tmp_path: Path, lines: Lines) -> Path:
    rows = "".join(",".join(map(str, line)) + "\n" for line in lines)
    return written(tmp_path, "plan.csv", f"x1,y1,x2,y2\n{rows}")


def assumed(imported: ImportedMap) -> list[str]:
    return list(notes(imported, "assumed"))


def thickness(imported: ImportedMap, lines: Lines = HOUSE) -> list[float]:
    """Return how far the two faces of each wall are apart near its begin, metres; free space is on their left."""
    faces, found = imported.map.segments, []
    for x1, y1, x2, y2 in lines:
        at = np.array([x1 + 0.15 * (x2 - x1), y1 + 0.15 * (y2 - y1)])
        normal = np.array([y1 - y2, x2 - x1]) / np.hypot(x2 - x1, y2 - y1)
        along = np.einsum("ij,ij->i", at - faces.endpoints[:, :2], faces.directions)
        beside = (along > 0.0) & (along < faces.lengths)
        off = (faces.midpoints - at) @ normal
        facing = faces.normals @ normal
        near = np.abs(off) < 0.5
        found.append(min(off[beside & near & (facing > 0.9)]) - max(off[beside & near & (facing < -0.9)]))
    return [round(float(value), 6) for value in found]


def test_lines_that_meet_in_the_middle_of_others_are_centre_lines(tmp_path: Path) -> None:
    imported = read_map(csv(tmp_path, HOUSE))
    assert imported.map.oriented
    assert thickness(imported) == [0.2] * len(HOUSE)
    assert assumed(imported) == ["centres", "thickness_usual"]
    assert "0.2 m thick" in notes(imported)["thickness_usual"].message
    assert "drawn to faces" in notes(imported)["centres"].message
    # Outside four faces, four in a room, in the two that the door parts five, and two ends at the door.
    assert len(imported.map.segments) == 4 + 4 + 2 * 5 + 2
    corners = {tuple(point) for point in imported.map.segments.endpoints.round(4).reshape(-1, 2).tolist()}
    assert len(corners) == len(imported.map.segments)  # each ends where another begins
    assert imported.map.meta == {"source": "plan.csv", "thickness": "0.2"}


@pytest.mark.parametrize(
    "lines",
    [
        OUTLINE,
        [*OUTLINE, *[[x + 20 for x in line] for line in OUTLINE]],
        # Two rooms, each with an outline of its own, and the wall between them.
        [[0, 0, 4, 0], [4, 0, 4, 6], [4, 6, 0, 6], [0, 6, 0, 0], [4.2, 0, 8, 0], [8, 0, 8, 6], [8, 6, 4.2, 6],
         [4.2, 6, 4.2, 0]],
        # The faces of a wall that end in the middle of another, as a careless drawing has them.
        [*OUTLINE, [0, 2.9, 8, 2.9], [0, 3.1, 8, 3.1]],
    ],
    ids=["an outline", "two outlines", "two rooms", "faces that end in a T"],
)  # fmt: skip
def test_faces_are_not_taken_for_centre_lines(tmp_path: Path, lines: Lines) -> None:
    imported = read_map(csv(tmp_path, lines))
    assert assumed(imported) == ["directions"]
    assert len(imported.map.segments) == len(lines)


@pytest.mark.parametrize(
    "said",
    [
        ImportOptions(drawn="faces"),
        ImportOptions(oriented=False),
        ImportOptions(oriented=True),
        ImportOptions(point=((1.0, 1.0),)),
    ],
    ids=["faces", "none", "drawn", "point"],
)
def test_what_the_caller_says_goes_first(tmp_path: Path, said: ImportOptions) -> None:
    assert "centres" not in assumed(read_map(csv(tmp_path, HOUSE), said))


def test_walls_that_go_on_straight_are_drawn_once(tmp_path: Path) -> None:
    """An outer wall in two pieces, where an inner one meets it."""
    pieces = [[0, 0, 5, 0], [5, 0, 8, 0], *OUTLINE[1:], [5, 0, 5, 6], [5, 3, 8, 3]]
    faces = read_map(csv(tmp_path, pieces)).map.segments
    lower = [sorted((begin, end)) for begin, y, end, other in faces.endpoints.round(4) if y == other == -0.1]
    assert sorted(lower) == [[-0.1, 5.0], [5.0, 8.1]]


def test_a_map_of_our_own_stays_as_it_is(tmp_path: Path) -> None:
    imported = read_map(written(tmp_path, "own.json", json.dumps({"segments": HOUSE, "oriented": False})))
    assert (len(imported.map.segments), imported.map.oriented) == (len(HOUSE), False)


def test_widths_of_polylines_old_and_new(tmp_path: Path) -> None:
    document = new(units=units.CM)
    space = document.modelspace()
    space.add_lwpolyline([(0, 0), (800, 0), (800, 600), (0, 600)], close=True, dxfattribs={"const_width": 36})
    space.add_lwpolyline([(0, 300, 12, 12), (800, 300, 12, 12)])
    space.add_polyline2d([(500, 300), (500, 600)], dxfattribs={"default_start_width": 10, "default_end_width": 10})
    imported = read_map(saved(tmp_path, document))
    assert thickness(imported, [*OUTLINE, [0, 3, 8, 3], [5, 3, 5, 6]]) == [0.36] * 4 + [0.12, 0.1]
    assert assumed(imported) == ["centres", "thickness_drawn"]


def drawn_in_svg(lines: Lines, how: str = "") -> str:
    return "".join(f'<line {how} x1="{a}" y1="{b}" x2="{c}" y2="{d}"/>' for a, b, c, d in lines)


def test_lines_of_an_svg_as_wide_as_walls(tmp_path: Path) -> None:
    inner = drawn_in_svg(INNER[:1], 'style="fill:none;stroke-width:0.3px"') + drawn_in_svg(
        INNER[1:], 'stroke-width="5%"'
    )
    body = f'<g transform="scale(100)"><g stroke-width="0.4">{drawn_in_svg(OUTLINE)}</g>{inner}</g>'
    imported = read_map(svg(tmp_path, body, ""), ImportOptions(units="cm"))
    upright = [[x1, -y1, x2, -y2] for x1, y1, x2, y2 in HOUSE]
    assert thickness(imported, upright) == [0.4] * 4 + [0.3, 0.4, 0.4]  # those without a number get the median
    assert "2 lines without a width" in notes(imported)["thickness_drawn"].message


def test_the_thickness_that_a_geojson_has(tmp_path: Path) -> None:
    features = [feature([line[:2], line[2:]], thickness=0.24) for line in OUTLINE]
    features += [feature([line[:2], line[2:]], width=0.1, thickness="thin") for line in INNER]
    imported = read_map(geojson(tmp_path, *features), ImportOptions(local_metres=True))
    assert thickness(imported) == [0.24] * 4 + [0.1] * 3


@pytest.mark.parametrize("oriented", [True, False])
def test_a_map_comes_back_to_the_bit(tmp_path: Path, oriented: bool) -> None:
    corners, points = [[1.5, 2.5, 4.25, 0.75], [0.1, 1 / 3, -7e3, 2e3]], np.array([[1.0, 1 / 3]])
    written = LineMap(Segments.from_array(corners), 0.04, oriented, "hall", {"source": "drawn"}, points, 0.03)
    path = tmp_path / "map.json"
    write_map(written, path)
    again = read_map(path).map
    assert again.segments.endpoints.tolist() == corners
    assert again.oriented is oriented
    assert (again.sigma, again.frame_id, again.meta) == (0.04, "hall", {"source": "drawn"})
    assert (again.points.tolist(), again.points_sigma) == (points.tolist(), 0.03)


def test_other_formats_are_not_written(tmp_path: Path) -> None:
    one = LineMap(Segments.from_array([[0, 0, 1, 0]]))
    with pytest.raises(UnsupportedFormatError, match=r"ends in \.json"):
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
