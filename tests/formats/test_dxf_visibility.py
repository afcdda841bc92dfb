"""Parts of a DXF that AutoCAD hides are no walls: layers off or frozen, blocks on them, invisible entities."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import pytest
from ezdxf import units
from ezdxf.document import Drawing as Document
from ezdxf.filemanagement import new

from formats import ImportedMap, ImportOptions, read_map

ALL = ImportOptions(layers=("*",))
ROOM = ((0.0, 0.0), (7.0, 0.0), (7.0, 4.0), (0.0, 4.0))


def plan(*layers: str) -> Document:
    """A room on the layer A, and other layers."""
    document = new(units=units.M)
    for layer in ("A", *layers):
        document.layers.add(layer)
    document.modelspace().add_lwpolyline(ROOM, close=True, dxfattribs={"layer": "A"})
    return document


def read(tmp_path: Path, document: Document, options: ImportOptions | None = None) -> ImportedMap:
    document.saveas(tmp_path / "plan.dxf")
    return read_map(tmp_path / "plan.dxf", options or ImportOptions())


def lengths(tmp_path: Path, document: Document) -> list[float]:
    """Lengths of the lines that are read next to the room, decimetres."""
    found = sorted(round(10 * length) for length in read(tmp_path, document, ALL).map.segments.lengths)
    for length in (40, 40, 70, 70):
        found.remove(length)
    return found


def dropped(tmp_path: Path, document: Document) -> dict[str, tuple[str, int]]:
    report = read(tmp_path, document, ALL).report
    return {note.code: (note.message, note.count) for note in report.dropped}


def hide(document: Document, layer: str, how: str) -> None:
    found = document.layers.get(layer)
    found.freeze() if how == "frozen" else found.off()


@pytest.mark.parametrize(("how", "left"), [("frozen", []), ("off", [20])])
def test_a_block_on_a_hidden_layer(tmp_path: Path, how: str, left: list[int]) -> None:
    """A frozen layer hides all of it, one that is off what is on layer 0 of the block."""
    document = plan("HIDDEN", "SHOWN")
    block = document.blocks.new("DESK")
    block.add_line((0, 0), (1, 0))
    block.add_line((0, 1), (2, 1), dxfattribs={"layer": "SHOWN"})
    block.add_line((0, 2), (3, 2), dxfattribs={"layer": "hidden"})
    document.modelspace().add_blockref("DESK", (1, 1), dxfattribs={"layer": "HIDDEN"})
    assert lengths(tmp_path, document) == [10, 20, 30]
    hide(document, "HIDDEN", how)
    assert lengths(tmp_path, document) == left
    message, count = dropped(tmp_path, document)["hidden_layer"]
    assert "HIDDEN" in message
    assert count == (1 if how == "frozen" else 2)


@pytest.mark.parametrize("how", ["frozen", "off"])
def test_layer_0_goes_through_blocks_in_blocks(tmp_path: Path, how: str) -> None:
    document = plan("HIDDEN", "SHOWN")
    document.blocks.new("INNER").add_line((0, 0), (1, 0))
    document.blocks.new("MIDDLE").add_blockref("INNER", (0, 0))
    document.modelspace().add_blockref("MIDDLE", (1, 1), dxfattribs={"layer": "HIDDEN"})
    document.modelspace().add_blockref("MIDDLE", (1, 2), dxfattribs={"layer": "SHOWN"})
    assert lengths(tmp_path, document) == [10, 10]
    hide(document, "HIDDEN", how)
    assert lengths(tmp_path, document) == [10]


@pytest.mark.parametrize(("how", "left"), [("frozen", []), ("off", [20])])
def test_a_hidden_reference_within_a_block(tmp_path: Path, how: str, left: list[int]) -> None:
    document = plan("HIDDEN", "SHOWN")
    inner = document.blocks.new("INNER")
    inner.add_line((0, 0), (1, 0))
    inner.add_line((0, 0), (2, 0), dxfattribs={"layer": "SHOWN"})
    document.blocks.new("OUTER").add_blockref("INNER", (0, 0), dxfattribs={"layer": "HIDDEN"})
    document.modelspace().add_blockref("OUTER", (1, 1), dxfattribs={"layer": "SHOWN"})
    hide(document, "HIDDEN", how)
    assert lengths(tmp_path, document) == left


@pytest.mark.parametrize("how", ["frozen", "off"])
def test_a_hidden_layer_0(tmp_path: Path, how: str) -> None:
    """An entity on layer 0 of a block is on the layer of its reference, and hidden where that is layer 0 itself."""
    document = plan("SHOWN")
    document.blocks.new("DESK").add_line((0, 0), (1, 0))
    document.modelspace().add_line((0, 1), (2, 1))
    document.modelspace().add_blockref("DESK", (1, 1), dxfattribs={"layer": "SHOWN"})
    document.modelspace().add_blockref("DESK", (1, 2))
    assert lengths(tmp_path, document) == [10, 10, 20]
    hide(document, "0", how)
    assert lengths(tmp_path, document) == [10]


def test_invisible_entities_and_blocks(tmp_path: Path) -> None:
    """Dynamic blocks hide their other states so."""
    document = plan()
    block = document.blocks.new("DOOR")
    block.add_line((0, 0), (1, 0))
    block.add_line((0, 0), (2, 0), dxfattribs={"invisible": 1})
    document.modelspace().add_blockref("DOOR", (1, 1))
    document.modelspace().add_blockref("DOOR", (2, 2), dxfattribs={"invisible": 1})
    document.modelspace().add_lwpolyline([(0, 0), (3, 0)], dxfattribs={"invisible": 1})
    assert lengths(tmp_path, document) == [10]
    assert dropped(tmp_path, document)["invisible"][1] == 3


def test_rows_of_a_block_on_a_frozen_layer(tmp_path: Path) -> None:
    document = plan("HIDDEN")
    document.blocks.new("DESK").add_line((0, 0), (1, 0))
    rows = {"layer": "HIDDEN", "row_count": 2, "column_count": 3, "row_spacing": 0.5, "column_spacing": 2}
    document.modelspace().add_blockref("DESK", (0.5, 0.5), dxfattribs=rows)
    assert lengths(tmp_path, document) == [10] * 6
    hide(document, "HIDDEN", "frozen")
    assert lengths(tmp_path, document) == []


def test_a_wall_layer_is_asked_for_by_the_layer_of_the_reference(tmp_path: Path) -> None:
    document = plan("WALLS", "DESKS")
    document.blocks.new("THING").add_line((0, 0), (1, 0))
    document.modelspace().add_blockref("THING", (1, 1), dxfattribs={"layer": "WALLS"})
    document.modelspace().add_blockref("THING", (1, 2), dxfattribs={"layer": "DESKS"})
    found = read(tmp_path, document, ImportOptions(layers=("WALLS",)))
    assert len(found.map.segments) == 1
    other = {note.code: note for note in found.report.dropped}
    assert "A (1), DESKS (1)" in other["other_layer"].message


def closed(document: Document, points: Iterable[tuple[float, float]], layer: str) -> None:
    document.modelspace().add_lwpolyline(points, close=True, dxfattribs={"layer": layer})


def test_layers_whose_names_say_wall_are_taken_alone(tmp_path: Path) -> None:
    document = new(units=units.M)
    closed(document, ROOM, "Außenwand")
    closed(document, [(x + 9, y) for x, y in ROOM], "A-FURN")
    imported = read(tmp_path, document)
    assert len(imported.map.segments) == 4
    (said,) = [note.message for note in imported.report.assumed if note.code == "layers"]
    assert said.startswith("walls are on Außenwand, by their names, and not on A-FURN")
    assert len(read(tmp_path, document, ImportOptions(layers=("*",))).map.segments) == 8
    document.layers.add("A-FURN")
    document.layers.get("A-FURN").off()
    assert "layers" not in str(read(tmp_path, document).report.assumed)


def test_all_layers_are_taken_and_named_where_none_says_wall(tmp_path: Path) -> None:
    document = new(units=units.M)
    closed(document, ROOM, "1")
    closed(document, [(x + 9, y) for x, y in ROOM], "2")
    imported = read(tmp_path, document)
    assert len(imported.map.segments) == 8
    assert "lines of all layers are walls: 1, 2" in str(imported.report.assumed)
