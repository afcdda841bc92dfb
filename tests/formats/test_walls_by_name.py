"""Walls of one floor by the names that drawings give them; parts that a drawing hides are no walls."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from ezdxf import units
from ezdxf.document import Drawing as Document
from ezdxf.filemanagement import new

from formats import ImportedMap, ImportOptions, IncompleteFileError, read_map

from .reading import feature, geojson, notes, rows, saved, svg

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
def test_the_own_layer_of_an_entity_counts(tmp_path: Path, wall: tuple[str, ...], other: tuple[str, ...]) -> None:
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


ROOM = ((0.0, 0.0), (7.0, 0.0), (7.0, 4.0), (0.0, 4.0))
INVISIBLE = {"invisible": 1}
COPIES = {"row_count": 2, "column_count": 3, "row_spacing": 0.5, "column_spacing": 2}

# An entity of a block or of the model: a line of so many metres or a block, its layer, and other attributes.
Part = tuple[float | str, str] | tuple[float | str, str, dict[str, Any]]


def plan(blocks: dict[str, list[Part]], model: list[Part]) -> Document:
    """Return a drawing of a room on the layer A, and of these blocks and parts."""
    document = new(units=units.M)
    for layer in ("A", "HIDDEN", "SHOWN"):
        document.layers.add(layer)
    document.modelspace().add_lwpolyline(ROOM, close=True, dxfattribs={"layer": "A"})
    spaces: list[tuple[Any, list[Part]]] = [(document.blocks.new(name), parts) for name, parts in blocks.items()]
    for space, parts in [*spaces, (document.modelspace(), model)]:
        for y, (what, layer, *more) in enumerate(parts):
            attributes = {"layer": layer} | (more[0] if more else {})
            if isinstance(what, str):
                space.add_blockref(what, (0.5, 0.5 + y), dxfattribs=attributes)
            else:
                space.add_line((0, y), (what, y), dxfattribs=attributes)
    return document


def read(tmp_path: Path, document: Document, *layers: str) -> ImportedMap:
    return read_map(saved(tmp_path, document), ImportOptions(layers=layers, drawn="faces"))


def lengths(imported: ImportedMap) -> list[float]:
    """Return the lengths of the lines that are read next to the room, metres."""
    found = sorted(imported.map.segments.lengths.round(3).tolist())
    for length in (4, 4, 7, 7):
        found.remove(length)
    return found


@pytest.mark.parametrize(
    ("blocks", "model", "hidden", "shown", "frozen", "off"),
    [
        pytest.param(
            {"DESK": [(1, "0"), (2, "SHOWN"), (3, "hidden")]}, [("DESK", "HIDDEN")], "HIDDEN", [1, 2, 3], [], [2],
            id="a block: what is off hides what is on layer 0 of the block",
        ),
        pytest.param(
            {"INNER": [(1, "0")], "MIDDLE": [("INNER", "0")]}, [("MIDDLE", "HIDDEN"), ("MIDDLE", "SHOWN")],
            "HIDDEN", [1, 1], [1], [1], id="layer 0 goes through blocks in blocks",
        ),
        pytest.param(
            {"INNER": [(1, "0"), (2, "SHOWN")], "OUTER": [("INNER", "HIDDEN")]}, [("OUTER", "SHOWN")],
            "HIDDEN", [1, 2], [], [2], id="a reference within a block",
        ),
        pytest.param(
            {"DESK": [(1, "0")]}, [(2, "0"), ("DESK", "SHOWN"), ("DESK", "0")], "0", [1, 1, 2], [1], [1],
            id="layer 0 itself",
        ),
        pytest.param({"DESK": [(1, "0")]}, [("DESK", "HIDDEN", COPIES)], "HIDDEN", [1] * 6, [], [], id="rows"),
    ],
)  # fmt: skip
def test_what_is_on_a_hidden_layer(
    tmp_path: Path,
    blocks: dict[str, list[Part]],
    model: list[Part],
    hidden: str,
    shown: list[float],
    frozen: list[float],
    off: list[float],
) -> None:
    document = plan(blocks, model)
    assert lengths(read(tmp_path, document, "*")) == shown
    layer = document.layers.get(hidden)
    layer.off()
    assert lengths(read(tmp_path, document, "*")) == off
    layer.on()
    layer.freeze()
    found = read(tmp_path, document, "*")
    assert lengths(found) == frozen
    assert hidden in notes(found)["hidden_layer"].message


def test_what_is_hidden_is_counted(tmp_path: Path) -> None:
    """A block on a frozen layer once, entities of a block on a layer that is off each."""
    document = plan({"DESK": [(1, "0"), (2, "SHOWN"), (3, "hidden")]}, [("DESK", "HIDDEN")])
    document.layers.get("HIDDEN").off()
    assert notes(read(tmp_path, document, "*"))["hidden_layer"].count == 2
    document.layers.get("HIDDEN").freeze()
    assert notes(read(tmp_path, document, "*"))["hidden_layer"].count == 1


def test_invisible_entities_and_blocks(tmp_path: Path) -> None:
    """Dynamic blocks hide their other states so."""
    desks: list[Part] = [("DESK", "0"), ("DESK", "0", INVISIBLE), (3, "0", INVISIBLE)]
    found = read(tmp_path, plan({"DESK": [(1, "0"), (2, "0", INVISIBLE)]}, desks), "*")
    assert lengths(found) == [1]
    assert notes(found)["invisible"].count == 3


def test_a_wall_layer_is_asked_for_by_the_layer_of_the_reference(tmp_path: Path) -> None:
    found = read(tmp_path, plan({"THING": [(1, "0")]}, [("THING", "SHOWN"), ("THING", "HIDDEN")]), "show*")
    assert len(found.map.segments) == 1
    assert "A (1), HIDDEN (1)" in notes(found)["other_layer"].message


def two_rooms(first: str, second: str) -> Document:
    document = new(units=units.M)
    for x, layer in ((0, first), (9, second)):
        document.modelspace().add_lwpolyline([(x + a, b) for a, b in ROOM], close=True, dxfattribs={"layer": layer})
    return document


def test_layers_whose_names_say_wall_are_taken_alone(tmp_path: Path) -> None:
    document = two_rooms("Außenwand", "A-FURN")
    imported = read(tmp_path, document)
    assert len(imported.map.segments) == 4
    assert notes(imported)["layers"].message.startswith("walls are on Außenwand, by their names, and not on A-FURN")
    assert len(read(tmp_path, document, "*").map.segments) == 8
    document.layers.add("A-FURN").off()
    assert "layers" not in notes(read(tmp_path, document))


def test_all_layers_are_taken_and_named_where_none_says_wall(tmp_path: Path) -> None:
    imported = read(tmp_path, two_rooms("1", "2"))
    assert len(imported.map.segments) == 8
    assert "lines of all layers are walls: 1, 2" in notes(imported)["layers"].message
