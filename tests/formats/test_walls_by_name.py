"""Walls of one floor by the names that drawings give them: layers, blocks, groups, classes, tags."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from ezdxf.filemanagement import new

from formats import ImportOptions, IncompleteFileError, MalformedFileError, read_map

from .drawn import feature, geojson, saved, svg, written
from .reading import notes, rows

METRES = ImportOptions(units="m", drawn="faces")
WALL, OTHER = [0.0, 0.0, 4.0, 0.0], [0.0, 3.0, 2.0, 3.0]


def dxf(folder: Path, wall: tuple[str, ...], other: tuple[str, ...], block: str = "PART") -> Path:
    """Write two lines, each on the last of its layers, in a block on the first where there are two."""
    document = new(units=6)
    for k, (layers, line) in enumerate(((wall, WALL), (other, OTHER))):
        space: Any = document.modelspace()
        if len(layers) > 1:
            name = f"{block} {k}"
            space.add_blockref(name, (0, 0), dxfattribs={"layer": layers[0]})
            space = document.blocks.new(name)
        space.add_line(line[:2], line[2:], dxfattribs={"layer": layers[-1]})
    return saved(folder, document)


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
    imported = read_map(dxf(tmp_path, wall, other), METRES)
    assert rows(imported) == [WALL]
    assert "set the option layers for others" in notes(imported)["layers"].message


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
    path = dxf(tmp_path, first, second, "Level")
    with pytest.raises(IncompleteFileError, match=rf"has 2 levels.*--level '{level}'; '\*' is all"):
        read_map(path, METRES)
    assert rows(read_map(path, ImportOptions(drawn="faces", level=level))) == [WALL]
    assert len(rows(read_map(path, ImportOptions(drawn="faces", level="*")))) == 2


def tagged(folder: Path, first: dict[str, Any], second: dict[str, Any]) -> Path:
    pairs = (WALL, first), (OTHER, second)
    return geojson(folder, *(feature([line[:2], line[2:]], **properties) for line, properties in pairs))


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
    below = {"elevation": 0} if "elevation" in below else below
    with pytest.raises(IncompleteFileError, match="has 2 levels"):
        read_map(tagged(tmp_path, below, properties), METRES)


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
    imported = read_map(tagged(tmp_path, {"indoor": "wall"}, properties), METRES)
    assert rows(imported) == [WALL]
    assert "set the option where" in notes(imported)["not_seen"].message


def test_kinds_and_lines_without_a_level_are_said(tmp_path: Path) -> None:
    path = tagged(tmp_path, {"indoor": "wall", "level": 1}, {"barrier": "fence"})
    found = notes(read_map(path, METRES))
    assert "indoor=wall (1), barrier=fence (1); set the option where" in found["kinds"].message
    assert "without a level are used with those of level 1" in found["no_level"].message


GROUP = '<g {}><line x1="0" y1="{y}" x2="{x}" y2="{y}" stroke="black"/></g>'
LABEL = 'xmlns:i="http://www.inkscape.org/namespaces/inkscape" i:label="{}"'


def groups(folder: Path, named: str, first: object, second: object) -> Path:
    pairs = (first, 4, 0), (second, 2, -3)
    return svg(folder, "".join(GROUP.format(named.format(name), x=x, y=y) for name, x, y in pairs))


@pytest.mark.parametrize("named", ['id="{}"', 'class="{}"', 'data-name="{}"', LABEL])
def test_groups_of_svg_are_layers(tmp_path: Path, named: str) -> None:
    imported = read_map(groups(tmp_path, named, "Walls", "Furniture"), METRES)
    assert rows(imported) == [WALL]
    assert "not on Furniture" in notes(imported)["layers"].message


@pytest.mark.parametrize("named", ['data-level="{}"', 'id="part" ' + LABEL.format("{}F"), 'id="Plan_L{}"'])
def test_groups_of_svg_are_floors(tmp_path: Path, named: str) -> None:
    with pytest.raises(IncompleteFileError, match="has 2 levels"):
        read_map(groups(tmp_path, named, 1, 2), METRES)


def test_the_heights_of_a_table_are_floors(tmp_path: Path) -> None:
    path = written(tmp_path, "a.csv", "x1,y1,z1,x2,y2,z2\n0,0,0,4,0,0\n0,3,3,2,3,3\n")
    with pytest.raises(IncompleteFileError, match="has 2 levels"):
        read_map(path)


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
    path = written(tmp_path, "a.geojson", json.dumps(line | {"crs": crs}))
    assert rows(read_map(path)) == [[692000, 5336000, 692004, 5336000]]


@pytest.mark.parametrize(
    ("inner", "expected"),
    [
        ("<style>@media screen{g{transform: translate(1px,0)}}</style><g>", [1, 0, 5, 0]),
        ("<style>@media print{g{transform: translate(1px,0)}}</style><g>", [0, 0, 4, 0]),
        ('<g style="scale: 50%">', [0, 0, 2, 0]),
    ],
)
def test_media_and_percentages_of_scale(tmp_path: Path, inner: str, expected: list[float]) -> None:
    path = svg(tmp_path, f'{inner}<line x1="0" y1="0" x2="4" y2="0" stroke="black"/></g>')
    assert rows(read_map(path, METRES)) == [expected]


@pytest.mark.parametrize(
    ("inner", "message"),
    [
        ('<g style="transform: translate(calc(1px + 1px), 0)"><path d="M0 0H4"/></g>', r"calc\(1px \+ 1px\)"),
        ('<path d="M0 0H4 what"/>', "d of a path element"),
    ],
)
def test_what_an_svg_says_and_is_not_read_is_named(tmp_path: Path, inner: str, message: str) -> None:
    with pytest.raises(MalformedFileError, match=message):
        read_map(svg(tmp_path, inner), METRES)
