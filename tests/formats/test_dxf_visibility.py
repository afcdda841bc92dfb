"""Parts of a DXF that AutoCAD hides are no walls: layers off or frozen, blocks on them, invisible entities."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from ezdxf import units
from ezdxf.document import Drawing as Document
from ezdxf.filemanagement import new

from formats import ImportedMap, ImportOptions, read_map

from .drawn import saved
from .reading import notes

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
    doors: list[Part] = [("DOOR", "0"), ("DOOR", "0", INVISIBLE), (3, "0", INVISIBLE)]
    found = read(tmp_path, plan({"DOOR": [(1, "0"), (2, "0", INVISIBLE)]}, doors), "*")
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
