"""Which layers of a drawing are taken for walls where no one states it."""

from __future__ import annotations

from pathlib import Path

from ezdxf import units
from ezdxf.document import Drawing as Document
from ezdxf.filemanagement import new

from formats import ImportOptions, read_map

SQUARE = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)]


def saved(tmp_path: Path, document: Document) -> Path:
    path = tmp_path / "plan.dxf"
    document.saveas(path)
    return path


def closed(document: Document, points: list[tuple[float, float]], layer: str) -> None:
    document.modelspace().add_lwpolyline(points, close=True, dxfattribs={"layer": layer})


def test_layers_whose_names_say_wall_are_taken_alone(tmp_path: Path) -> None:
    document = new(units=units.M)
    closed(document, SQUARE, "Außenwand")
    closed(document, [(x + 9, y) for x, y in SQUARE], "A-FURN")
    imported = read_map(saved(tmp_path, document))
    assert len(imported.map.segments) == 4
    (said,) = [note.message for note in imported.report.assumed if note.code == "layers"]
    assert said.startswith("walls are on Außenwand, by their names, and not on A-FURN")
    assert len(read_map(saved(tmp_path, document), ImportOptions(layers=("*",))).map.segments) == 8
    document.layers.add("A-FURN")
    document.layers.get("A-FURN").off()
    assert "layers" not in str(read_map(saved(tmp_path, document)).report.assumed)


def test_all_layers_are_taken_and_named_where_none_says_wall(tmp_path: Path) -> None:
    document = new(units=units.M)
    closed(document, SQUARE, "1")
    closed(document, [(x + 9, y) for x, y in SQUARE], "2")
    imported = read_map(saved(tmp_path, document))
    assert len(imported.map.segments) == 8
    assert "lines of all layers are walls: 1, 2" in str(imported.report.assumed)
