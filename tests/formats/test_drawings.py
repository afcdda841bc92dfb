"""Drawings made by ezdxf and by hand: units, layers, blocks, curves, faces and directions."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from ezdxf import units
from ezdxf.document import Drawing as Document
from ezdxf.filemanagement import new

from formats import (
    ImportedMap,
    ImportOptions,
    IncompleteFileError,
    InvalidOptionError,
    TooLargeError,
    read_map,
)

SQUARE = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)]


COPIES = {"row_count": 30_000, "column_count": 30_000, "row_spacing": 1, "column_spacing": 1}


def rows(imported: ImportedMap) -> list[list[float]]:
    rounded: list[list[float]] = (np.round(imported.map.segments.endpoints, 3) + 0.0).tolist()
    return rounded


def lines_of(points: list[tuple[float, float]]) -> list[list[float]]:
    return [[*a, *b] for a, b in zip(points, points[1:] + points[:1], strict=True)]


def notes(imported: ImportedMap) -> dict[str, int]:
    r = imported.report
    return {note.code: note.count for note in (*r.read, *r.merged, *r.dropped, *r.assumed)}


def dxf(tmp_path: Path, document: Document) -> Path:
    path = tmp_path / "plan.dxf"
    document.saveas(path)
    return path


def closed(document: Document, points: list[tuple[float, float]], layer: str = "0") -> None:
    document.modelspace().add_lwpolyline(points, close=True, dxfattribs={"layer": layer})


def text(tmp_path: Path, name: str, content: str) -> Path:
    path = tmp_path / name
    path.write_text(content)
    return path


def test_the_unit_of_a_dxf_is_its_own_or_the_callers(tmp_path: Path) -> None:
    document = new(units=units.MM)
    closed(document, [(1e3 * x, 1e3 * y) for x, y in SQUARE])
    assert rows(read_map(dxf(tmp_path, document))) == lines_of(SQUARE)
    document.header["$INSUNITS"] = 0
    with pytest.raises(IncompleteFileError, match="set the option units"):
        read_map(dxf(tmp_path, document))
    assert rows(read_map(dxf(tmp_path, document), ImportOptions(units="mm"))) == lines_of(SQUARE)
    assert rows(read_map(dxf(tmp_path, document), ImportOptions(units=0.001))) == lines_of(SQUARE)


def test_layers_are_chosen_by_pattern_and_hidden_ones_left_out(tmp_path: Path) -> None:
    document = new(units=units.M)
    closed(document, SQUARE, "A-WALL-INT")
    closed(document, [(x / 2, y / 2) for x, y in SQUARE], "A-FURN")
    hidden = document.layers.add("A-WALL-OLD")
    closed(document, [(x + 9, y) for x, y in SQUARE], "A-WALL-OLD")
    hidden.off()
    imported = read_map(dxf(tmp_path, document), ImportOptions(layers=("*wall*",)))
    assert rows(imported) == lines_of(SQUARE)
    assert notes(imported)["hidden_layer"] == 1
    assert notes(imported)["other_layer"] == 1


def test_blocks_are_taken_apart_where_they_stand(tmp_path: Path) -> None:
    document = new(units=units.M)
    inner = document.blocks.new("WALL")
    inner.add_line((0, 0), (2, 0))
    outer = document.blocks.new("TWO")
    outer.add_blockref("WALL", (0, 0))
    outer.add_blockref("WALL", (0, 1))
    document.modelspace().add_blockref("TWO", (10, 20), dxfattribs={"rotation": 90})
    # Turned by a quarter: (x, y) becomes (10 - y, 20 + x).
    assert rows(read_map(dxf(tmp_path, document))) == [[10, 20, 10, 22], [9, 20, 9, 22]]


def test_arcs_become_chords_within_a_centimetre_and_text_is_dropped(tmp_path: Path) -> None:
    document = new(units=units.M)
    document.modelspace().add_arc((0, 0), radius=5, start_angle=0, end_angle=90)
    document.modelspace().add_text("Hall")
    imported = read_map(dxf(tmp_path, document))
    segments = imported.map.segments
    assert segments.lengths.sum() == pytest.approx(2.5 * math.pi, rel=2e-3)
    assert np.hypot(*segments.midpoints.T).min() > 5 - 0.01
    assert notes(imported)["entity_text"] == 1


def test_a_block_in_itself_and_too_many_copies_are_refused(tmp_path: Path) -> None:
    document = new(units=units.M)
    for k in range(12):
        block = document.blocks.new(f"B{k}")
        for _ in range(10):
            block.add_blockref(f"B{k + 1}", (0, 0))
    document.blocks.new("B12").add_line((0, 0), (1, 0))
    document.modelspace().add_blockref("B0", (0, 0))
    with pytest.raises(TooLargeError, match="8 blocks in one another"):
        read_map(dxf(tmp_path, document))
    many = new(units=units.M)
    many.blocks.new("E")
    many.modelspace().add_blockref("E", (0, 0), dxfattribs=COPIES)
    with pytest.raises(TooLargeError, match="copies of a block"):
        read_map(dxf(tmp_path, many))


SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 10 10">{}</svg>'


def test_an_svg_is_read_upright_with_its_transforms(tmp_path: Path) -> None:
    body = (
        '<g id="walls" transform="translate(10 0)"><g transform="scale(2)"><line x1="0" y1="0" x2="1" y2="2"/></g></g>'
        '<rect x="0" y="0" width="4" height="3"/><path d="M0 5h2v1z"/><polyline points="0,7 1,7 1,8"/>'
        '<defs><line x1="0" y1="0" x2="9" y2="9"/></defs><text>Hall</text>'
        '<line style="display: none" x1="0" y1="0" x2="5" y2="5"/>'
    )
    imported = read_map(text(tmp_path, "a.svg", SVG.format(body)), ImportOptions(units="m"))
    assert rows(imported) == [
        [10, 0, 12, -4],
        [0, 0, 4, 0], [4, 0, 4, -3], [4, -3, 0, -3], [0, -3, 0, 0],
        [0, -5, 2, -5], [2, -5, 2, -6], [2, -6, 0, -5],
        [0, -7, 1, -7], [1, -7, 1, -8],
    ]  # fmt: skip
    assert notes(imported)["hidden"] == 1
    chosen = read_map(text(tmp_path, "a.svg", SVG.format(body)), ImportOptions(units="cm", layers=("WALL*",)))
    assert rows(chosen) == [[0.1, 0.0, 0.12, -0.04]]


def test_curves_of_an_svg_become_chords(tmp_path: Path) -> None:
    body = '<path d="M5 0 A5 5 0 0 1 0 5"/>'
    segments = read_map(text(tmp_path, "a.svg", SVG.format(body)), ImportOptions(units="m")).map.segments
    # Sixteen chords of a quarter of a circle with radius 5.
    np.testing.assert_allclose(segments.lengths, 2 * 5 * math.sin(math.pi / 64), rtol=1e-6)


def feature(kind: str, coordinates: object, layer: str = "wall") -> dict[str, object]:
    return {"type": "Feature", "properties": {"layer": layer}, "geometry": {"type": kind, "coordinates": coordinates}}


def test_geojson_is_read_as_metres_by_an_explicit_flag_alone(tmp_path: Path) -> None:
    features = [
        feature("Polygon", [[*SQUARE, SQUARE[0]]]),
        feature("MultiLineString", [[[9, 0], [9, 1, 7]]]),
        feature("LineString", [[0, 0], [1, 1]], "furniture"),
        feature("Point", [1, 1]),
    ]
    path = text(tmp_path, "a.geojson", json.dumps({"type": "FeatureCollection", "features": features}))
    with pytest.raises(IncompleteFileError, match="degrees"):
        read_map(path)
    imported = read_map(path, ImportOptions(local_metres=True, layers=("wall",)))
    assert rows(imported) == [*lines_of(SQUARE), [9, 0, 9, 1]]
    assert not imported.map.oriented
    assert notes(imported)["entity_point"] == 1


@pytest.mark.parametrize(
    "table",
    [
        "0,0,4,0\n4,0,4,3\n",
        "x1;y1;x2;y2\n0;0;4;0\n4;0;4;3",
        "name\ty2\tx2\ty1\tx1\nw\t0\t4\t0\t0\nw\t3\t4\t0\t4\n",
        "# a comment\n\n0 0 4 0\n4 0 4 3\n",
    ],
)
def test_csv_is_read_whatever_parts_it(tmp_path: Path, table: str) -> None:
    assert rows(read_map(text(tmp_path, "a.csv", table))) == [[0, 0, 4, 0], [4, 0, 4, 3]]


def test_lines_drawn_twice_are_merged_and_specks_dropped(tmp_path: Path) -> None:
    imported = read_map(text(tmp_path, "a.csv", "0,0,4,0\n4,0,0,0\n0,0,4,0\n1,1,1,1.001\n"))
    assert rows(imported) == [[0, 0, 4, 0]]
    assert notes(imported) == {"doubles": 2, "short": 1, "segments": 1, "directions": 0}


def test_centre_lines_become_two_faces_apart_by_the_thickness(tmp_path: Path) -> None:
    path = text(tmp_path, "a.csv", "0,0,4,0\n")
    imported = read_map(path, ImportOptions(drawn="centres", thickness=0.2))
    # Free space on the left of each: the upper face runs along +x, the lower one back, and both ends are closed.
    assert rows(imported) == [[0, 0.1, 4, 0.1], [4, -0.1, 0, -0.1], [0, -0.1, 0, 0.1], [4, 0.1, 4, -0.1]]
    assert imported.map.oriented


def test_the_thickness_is_found_where_a_polyline_has_a_width(tmp_path: Path) -> None:
    document = new(units=units.CM)
    document.modelspace().add_lwpolyline([(0, 0), (400, 0)], dxfattribs={"const_width": 30})
    imported = read_map(dxf(tmp_path, document), ImportOptions(drawn="centres"))
    assert rows(imported)[:2] == [[0, 0.15, 4, 0.15], [4, -0.15, 0, -0.15]]


def test_directions_are_found_from_a_place_inside(tmp_path: Path) -> None:
    # A room drawn without regard to direction within the outline of its walls, 0.3 m thick, and a partition.
    inner = "0,0,4,0\n4,3,4,0\n4,3,0,3\n0,0,0,3\n"
    outer = "-0.3,-0.3,4.3,-0.3\n4.3,-0.3,4.3,3.3\n4.3,3.3,-0.3,3.3\n-0.3,3.3,-0.3,-0.3\n"
    path = text(tmp_path, "a.csv", inner + outer + "2,0,2,2\n")
    imported = read_map(path, ImportOptions(inside=((1.0, 1.0),)))
    assert imported.map.oriented
    found = {tuple(row) for row in rows(imported)}
    assert {(0, 0, 4, 0), (4, 0, 4, 3), (4, 3, 0, 3), (0, 3, 0, 0), (2, 0, 2, 2), (2, 2, 2, 0)} <= found
    assert len(found) == 6 + 2 * 4  # the outline cannot be reached: both directions
    assert notes(imported)["not_reached"] == 4
    with pytest.raises(InvalidOptionError, match=r"inside\[1\]: lies on a line or outside"):
        read_map(path, ImportOptions(inside=((1.0, 1.0), (50.0, 1.0))))


def test_directions_mean_what_the_caller_says(tmp_path: Path) -> None:
    path = text(tmp_path, "a.csv", "0,0,4,0\n")
    assert not read_map(path).map.oriented
    assert read_map(path, ImportOptions(directions="drawn")).map.oriented
    path = text(tmp_path, "a.json", '{"segments": [[0, 0, 4, 0]], "sigma": 0.03, "frame_id": "hq", "meta": {"a": "b"}}')
    own = read_map(path).map
    assert (own.oriented, own.sigma, own.frame_id, own.meta) == (True, 0.03, "hq", {"a": "b"})
    assert not read_map(path, ImportOptions(directions="none")).map.oriented


@pytest.mark.parametrize(
    "wrong",
    [{"units": "furlong"}, {"units": 0.0}, {"thickness": -1.0}, {"inside": ((math.nan, 0.0),)}, {"drawn": "both"}],
)
def test_options_out_of_range_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(InvalidOptionError):
        ImportOptions(**wrong)  # type: ignore[arg-type]
