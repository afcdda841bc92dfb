"""Walls of one floor by the names that drawings give them: layers, blocks, groups, classes, tags."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from ezdxf.filemanagement import new

from formats import ImportedMap, ImportOptions, IncompleteFileError, MalformedFileError, read_map

METRES = ImportOptions(units="m", drawn="faces")
WALL, OTHER = [0.0, 0.0, 4.0, 0.0], [0.0, 3.0, 2.0, 3.0]


def rows(imported: ImportedMap) -> list[list[float]]:
    return sorted([round(float(v), 6) for v in row] for row in imported.map.segments.endpoints)


def noted(imported: ImportedMap) -> dict[str, str]:
    return {note.code: note.message for note in (*imported.report.dropped, *imported.report.assumed)}


def dxf(path: Path, wall: tuple[str, ...], other: tuple[str, ...], block: str = "") -> Path:
    """Write two lines, each on the last of its layers, in a block on the first where there are two."""
    document = new(units=6)
    for k, (layers, line) in enumerate(((wall, WALL), (other, OTHER))):
        space: Any = document.modelspace()
        if len(layers) > 1:
            name = f"{block or 'PART'} {k}"
            space.add_blockref(name, (0, 0), dxfattribs={"layer": layers[0]})
            space = document.blocks.new(name)
        space.add_line(line[:2], line[2:], dxfattribs={"layer": layers[-1]})
    document.saveas(path)
    return path


@pytest.mark.parametrize(
    ("wall", "other"),
    [
        (("A-WALL",), ("A-FURN",)),
        (("A-WALL",), ("A-WALL", "A-DOOR")),
        (("X-WALLPLAN", "P$0$A-WALL"), ("X-WALLPLAN", "P$0$A-FURN")),
        (("A-WALL", "0"), ("A-FURN", "0")),
        (("Walls",), ("Wall openings",)),
        (("A_WALL",), ("A_WALL_DEMO",)),
        (("Wände",), ("Möbel",)),
    ],
)
def test_the_own_layer_of_an_entity_tells_whether_it_is_a_wall(
    tmp_path: Path, wall: tuple[str, ...], other: tuple[str, ...]
) -> None:
    imported = read_map(dxf(tmp_path / "a.dxf", wall, other), METRES)
    assert rows(imported) == [WALL]
    assert "set the option layers for others" in noted(imported)["layers"]


@pytest.mark.parametrize(
    ("first", "second", "level"),
    [
        (("1F-WALL",), ("2F-WALL",), "1F"),
        (("A-WALL-L01",), ("A-WALL-L02",), "L01"),
        (("Wand EG",), ("Wand OG",), "EG"),
        (("WALLS_FLOOR1",), ("WALLS_FLOOR2",), "FLOOR1"),
        (("Ebene 0",), ("Ebene 1",), "Ebene 0"),
        (("0", "WALLS"), ("0", "WALLS"), "Level 0"),
    ],
)
def test_floors_are_named_anywhere_in_layers_and_blocks(
    tmp_path: Path, first: tuple[str, ...], second: tuple[str, ...], level: str
) -> None:
    path = dxf(tmp_path / "a.dxf", first, second, "Level")
    with pytest.raises(IncompleteFileError, match=rf"has 2 levels.*--level '{level}'; '\*' is all"):
        read_map(path, METRES)
    assert rows(read_map(path, ImportOptions(drawn="faces", level=level))) == [WALL]
    assert len(rows(read_map(path, ImportOptions(drawn="faces", level="*")))) == 2


def geojson(path: Path, *properties: dict[str, Any]) -> Path:
    features = [
        {"type": "Feature", "properties": told, "geometry": {"type": "LineString", "coordinates": [[*a], [*b]]}}
        for told, a, b in zip(properties, (WALL[:2], OTHER[:2]), (WALL[2:], OTHER[2:]), strict=True)
    ]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


@pytest.mark.parametrize(
    "properties",
    [
        {"Level": "1"},
        {"Floor": 1},
        {"addr:floor": "1"},
        {"BuildingStorey": "1"},
        {"tags": {"indoor": "wall", "level": "1"}},
        {"other_tags": '"indoor"=>"wall","level"=>"1"'},
        {"elevation": 3.5},
    ],
)
def test_floors_by_properties_of_any_tool(tmp_path: Path, properties: dict[str, Any]) -> None:
    below = {key: json.loads(json.dumps(value).replace("1", "0")) for key, value in properties.items()}
    path = geojson(tmp_path / "a.geojson", below if "elevation" not in below else {"elevation": 0}, properties)
    with pytest.raises(IncompleteFileError, match="has 2 levels"):
        read_map(path, METRES)


@pytest.mark.parametrize(
    "properties",
    [
        {"HIGHWAY": "footway"},
        {"IfcClass": "IfcDoor"},
        {"Type": "Door"},
        {"tags": {"highway": "footway"}},
        {"other_tags": '"highway"=>"footway"'},
        {"boundary": "administrative"},
    ],
)
def test_tags_of_any_case_and_packing_tell_what_no_laser_sees(tmp_path: Path, properties: dict[str, Any]) -> None:
    imported = read_map(geojson(tmp_path / "a.geojson", {"indoor": "wall"}, properties), METRES)
    assert rows(imported) == [WALL]
    assert "set the option where" in noted(imported)["not_seen"]


def test_kinds_and_lines_without_a_level_are_said(tmp_path: Path) -> None:
    path = geojson(tmp_path / "a.geojson", {"indoor": "wall", "level": 1}, {"barrier": "fence"})
    notes = noted(read_map(path, METRES))
    assert "indoor=wall (1), barrier=fence (1); set the option where" in notes["kinds"]
    assert "without a level are used with those of level 1" in notes["no_level"]


GROUP = '<g {}><line x1="0" y1="{y}" x2="{x}" y2="{y}" stroke="black"/></g>'
LABEL = 'xmlns:i="http://www.inkscape.org/namespaces/inkscape" i:label="{}"'


def svg(path: Path, first: str, second: str) -> Path:
    inner = GROUP.format(first, x=4, y=0) + GROUP.format(second, x=2, y=-3)
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 -9 9 9">{inner}</svg>')
    return path


@pytest.mark.parametrize("named", ['id="{}"', 'class="{}"', 'data-name="{}"', LABEL])
def test_groups_of_svg_are_layers(tmp_path: Path, named: str) -> None:
    imported = read_map(svg(tmp_path / "a.svg", named.format("Walls"), named.format("Furniture")), METRES)
    assert rows(imported) == [WALL]
    assert "not on Furniture" in noted(imported)["layers"]


@pytest.mark.parametrize("named", ['data-level="{}"', 'id="part" ' + LABEL.format("{}F"), 'id="Plan_L{}"'])
def test_groups_of_svg_are_floors(tmp_path: Path, named: str) -> None:
    with pytest.raises(IncompleteFileError, match="has 2 levels"):
        read_map(svg(tmp_path / "a.svg", named.format(1), named.format(2)), METRES)


@pytest.mark.parametrize(
    "text",
    [
        "x1,y1,x2,y2,Layer\n0,0,4,0,A-WALL\n0,3,2,3,A-FURN\n",
        "0,0,4,0,wall\n0,3,2,3,door\n",
        "% walls\nP1X|P1Y|P2X|P2Y\n0|0|4|0\n|||\n",
        "x1_mm,y1_mm,x2_mm,y2_mm\n0,0,4000,0\n",
        "x1;y1;x2;y2\n0;\u22120;4;0\n",
    ],
)
def test_tables_as_spreadsheets_have_them(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    assert rows(read_map(tmp_path / "a.csv")) == [WALL]


def test_the_heights_of_a_table_are_floors(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("x1,y1,z1,x2,y2,z2\n0,0,0,4,0,0\n0,3,3,2,3,3\n")
    with pytest.raises(IncompleteFileError, match="has 2 levels"):
        read_map(tmp_path / "a.csv")


@pytest.mark.parametrize(
    "crs",
    [
        {"type": "name", "properties": {"name": "http://www.opengis.net/def/crs/EPSG/0/25832"}},
        {"type": "name", "properties": {"name": "epsg:25832+5783"}},
        {"type": "name", "properties": {"name": "WGS 84 / UTM zone 32N"}},
        {"type": "EPSG", "properties": {"code": 25832}},
        "EPSG:32632",
    ],
)
def test_names_of_projected_systems(tmp_path: Path, crs: Any) -> None:
    line = {"type": "LineString", "coordinates": [[692000, 5336000], [692004, 5336000]]}
    (tmp_path / "a.geojson").write_text(json.dumps(line | {"crs": crs}))
    assert rows(read_map(tmp_path / "a.geojson")) == [[692000, 5336000, 692004, 5336000]]


def test_degrees_are_named_where_an_option_states_metres(tmp_path: Path) -> None:
    line = {"type": "LineString", "coordinates": [[16.6, 49.2], [16.6001, 49.2]]}
    (tmp_path / "a.geojson").write_text(json.dumps(line))
    with pytest.raises(IncompleteFileError, match="has degrees"):
        read_map(tmp_path / "a.geojson", METRES)


@pytest.mark.parametrize(
    ("inner", "expected"),
    [
        ("<style>@media screen{g{transform: translate(1px,0)}}</style><g>", [1, 0, 5, 0]),
        ("<style>@media print{g{transform: translate(1px,0)}}</style><g>", [0, 0, 4, 0]),
        ('<g style="scale: 50%">', [0, 0, 2, 0]),
    ],
)
def test_media_and_percentages_of_scale(tmp_path: Path, inner: str, expected: list[float]) -> None:
    text = f'{inner}<line x1="0" y1="0" x2="4" y2="0" stroke="black"/></g>'
    (tmp_path / "a.svg").write_text(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9">{text}</svg>')
    assert rows(read_map(tmp_path / "a.svg", METRES)) == [expected]


@pytest.mark.parametrize(
    ("inner", "message"),
    [
        ('<g style="transform: translate(calc(1px + 1px), 0)"><path d="M0 0H4"/></g>', r"calc\(1px \+ 1px\)"),
        ('<path d="M0 0H4 what"/>', "d of a path element"),
    ],
)
def test_what_an_svg_says_and_is_not_read_is_named(tmp_path: Path, inner: str, message: str) -> None:
    (tmp_path / "a.svg").write_text(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9">{inner}</svg>')
    with pytest.raises(MalformedFileError, match=message):
        read_map(tmp_path / "a.svg", METRES)
