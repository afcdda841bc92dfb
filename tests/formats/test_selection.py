"""Drawings of which a part is the map: one floor of several, walls among doors and footways, columns of a table."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from ezdxf.filemanagement import new

from formats import FormatError, ImportedMap, ImportOptions, IncompleteFileError, InvalidOptionError, read_map
from formats.errors import MalformedFileError

METRES = ImportOptions(local_metres=True, drawn="faces")
FACES = ImportOptions(drawn="faces", units="m")
RING = [[0, 0], [7, 0], [7, 5], [0, 5], [0, 0]]


def rows(imported: ImportedMap) -> list[list[float]]:
    return [[round(float(v), 6) for v in row] for row in imported.map.segments.endpoints]


def noted(imported: ImportedMap) -> dict[str, str]:
    report = imported.report
    return {note.code: note.message for note in (*report.read, *report.dropped, *report.assumed)}


def feature(y: float, *z: float, **properties: Any) -> dict[str, Any]:
    members = {"feature_type": properties.pop("feature_type")} if "feature_type" in properties else {}
    line = {"type": "LineString", "coordinates": [[0, y, *z], [4, y, *z]]}
    return {"type": "Feature", "properties": properties, "geometry": line} | members


def geojson(tmp_path: Path, *features: dict[str, Any], crs: str | None = None) -> Path:
    root: dict[str, Any] = {"type": "FeatureCollection", "features": features}
    if crs is not None:
        root["crs"] = {"type": "name", "properties": {"name": crs}}
    (tmp_path / "a.geojson").write_text(json.dumps(root))
    return tmp_path / "a.geojson"


def drawn(tmp_path: Path, *lines: tuple[tuple[float, ...], tuple[float, ...]]) -> Path:
    document = new()
    document.header["$INSUNITS"] = 6
    for begin, end in lines:
        document.modelspace().add_line(begin, end)
    document.saveas(tmp_path / "a.dxf")
    return tmp_path / "a.dxf"


def svg(tmp_path: Path, body: str) -> Path:
    (tmp_path / "a.svg").write_text(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9">{body}</svg>')
    return tmp_path / "a.svg"


def storeys(tmp_path: Path, kind: str) -> Path:
    """Return a file with a line at y = 1 on the lower floor, and one at y = 2 and y = 3 on the upper one."""
    if kind == "heights":
        return drawn(tmp_path, ((0, 1, 0), (4, 1, 0)), ((0, 2, 3.2), (4, 2, 3.2)), ((0, 3, 4.1), (4, 3, 4.1)))
    if kind == "svg":
        line = '<line x2="4" y1="{0}" y2="{0}" stroke="black"/>'
        groups = [("Level 0", "-1"), ("Level 3.2", "-2"), ("Level 3.2", "-3")]
        text = "".join(f'<g id="{name}">{line.format(y)}</g>' for name, y in groups)
        return svg(tmp_path, text.replace("Level 3.2", "1st floor"))
    if kind == "csv":
        (tmp_path / "a.csv").write_text("x1,y1,x2,y2,Level\n0,1,4,1,0\n0,2,4,2,3.2\n0,3,4,3,3.2\n")
        return tmp_path / "a.csv"
    if kind == "z":
        return geojson(tmp_path, feature(1, 0), feature(2, 3.2), feature(3, 3.2))
    return geojson(tmp_path, feature(1, **{kind: "0"}), feature(2, **{kind: 3.2}), feature(3, **{kind: "-3;3.2"}))


@pytest.mark.parametrize(
    ("kind", "upper"), [(k, "3.2") for k in ("level", "level_id", "z", "heights", "csv")] + [("svg", "1st floor")]
)
def test_several_floors_are_a_question_that_an_option_answers(tmp_path: Path, kind: str, upper: str) -> None:
    path, options = storeys(tmp_path, kind), FACES
    with pytest.raises(IncompleteFileError, match=rf"levels, with lines: .*{upper} \(2\).*--level") as caught:
        read_map(path, options)
    assert "\n" not in str(caught.value)
    imported = read_map(path, replace(options, level=upper.upper()))
    assert sorted(row[1] for row in rows(imported)) == [2, 3]
    assert imported.map.meta["level"] == upper
    assert noted(imported)["other_level"]
    with pytest.raises(InvalidOptionError, match=r"found another name"):
        read_map(path, replace(options, level="7"))


def test_one_floor_is_no_question(tmp_path: Path) -> None:
    frame = [(a, b) for z in (0, 2.7) for a, b in (((0, 0, z), (4, 0, z)), ((4, 0, z), (4, 3, z)))]
    posts = [((x, y, 0), (x, y, 2.7)) for x, y in ((0, 0), (4, 0), (4, 3))]
    assert len(rows(read_map(drawn(tmp_path, *frame, *posts), FACES))) == 2
    assert len(rows(read_map(geojson(tmp_path, feature(1, level="0-2"), feature(2, level="0;1;2")), METRES))) == 2
    assert len(rows(read_map(geojson(tmp_path, feature(1, level="2"), feature(2)), METRES))) == 2
    with pytest.raises(InvalidOptionError, match="names no levels"):
        read_map(geojson(tmp_path, feature(1)), ImportOptions(local_metres=True, level="0"))


def test_a_section_is_no_plan(tmp_path: Path) -> None:
    with pytest.raises(MalformedFileError, match=r"7 by 0 units in x and y, and 5 in z"):
        read_map(drawn(tmp_path, ((0, 0, 0), (7, 0, 0)), ((7, 0, 0), (7, 0, 5)), ((0, 0, 5), (7, 0, 5))), FACES)


OSM = [
    feature(1, indoor="wall"), feature(2, highway="footway"), feature(3, door="hinged"), feature(4, indoor="area"),
    feature(5, feature_type="opening"), feature(6, door="no", material=1), feature(7, category="IfcDoor", level=2),
]  # fmt: skip


@pytest.mark.parametrize(
    ("where", "kept", "code", "said"),
    [
        ((), [1, 6], "not_seen", "door=hinged (1), highway=footway (1)"),
        (("highway=*", "highway=x"), [2], "other_value", "no highway"),
        (("indoor=WALL", "indoor=ar*"), [1, 4], "other_value", "no indoor"),
        (("material=1",), [6], "other_value", "no material"),
        (("level=2", "category=*"), [7], "other_value", "no level"),
    ],
)
def test_what_no_laser_sees_is_left_out_and_properties_choose(
    tmp_path: Path, where: tuple[str, ...], kept: list[int], code: str, said: str
) -> None:
    imported = read_map(geojson(tmp_path, *OSM), ImportOptions(local_metres=True, drawn="faces", where=where))
    assert [row[1] for row in rows(imported)] == kept
    message = noted(imported)[code]
    assert all(part in message for part in said.split(", "))


def test_properties_of_dxf_csv_and_svg_choose_too(tmp_path: Path) -> None:
    document = new()
    for y, color in ((1, 1), (2, 3)):
        document.modelspace().add_line((0, y), (4, y), dxfattribs={"color": color})
    document.saveas(tmp_path / "b.dxf")
    (tmp_path / "b.csv").write_text("name,x1,y1,x2,y2,color\na,0,1,4,1,1\nb,0,2,4,2,3\n")
    svg(tmp_path, "".join(f'<line x2="4" y1="-{y}" y2="-{y}" stroke="black" color="{2 * y - 1}"/>' for y in (1, 2)))
    for name in ("b.dxf", "b.csv", "a.svg"):
        imported = read_map(tmp_path / name, ImportOptions(units="m", drawn="faces", where=("color=3",)))
        assert rows(imported) == [[0, 2, 4, 2]]


@pytest.mark.parametrize(
    ("text", "metres"),
    [
        ("0,00;0,00;7,00;2,50\n", 1), ("0,0 0,0 7,0 2,5\n", 1), ('"0,0","0,0","7,0","2,5"', 1),
        ("x1;y1;x2;y2\n0,0;0;7;2,5\n", 1), ("sep=;\nx1;y1;x2;y2\n0;0;7;2.5\n", 1), ("0,0,7,2.5,A-WALL\n", 1),
        ("start_x,start_y,end_x,end_y\n0,0,7,2.5\n", 1), ("x0,y0,x1,y1\n0,0,7,2.5\n", 1),
        ("id,X1 [mm],Y1 [mm],X2 [mm],Y2 [mm]\n9,0,0,7,2.5\n", 1e-3), ("A\t0\t0\t7\t2.5\n", 1),
    ],
)  # fmt: skip
def test_tables_of_spreadsheets(tmp_path: Path, text: str, metres: float) -> None:
    (tmp_path / "a.csv").write_text(text)
    options = ImportOptions() if metres == 1 else ImportOptions(units="m")
    assert rows(read_map(tmp_path / "a.csv", options)) == [[0, 0, 7, 2.5]]
    if metres != 1:
        with pytest.raises(FormatError, match=r"no line of 0.01 m"):
            read_map(tmp_path / "a.csv")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0,0.5,0,7,2.5\n", "line 1: has 5 columns of numbers"), ("# a\n0,0,0,7,2.5,0\n", "line 2: has 6 columns"),
        ("0,00,0,00,7,00,2,50\n", "line 1: has 8 columns"), ("0,0,7,2.5\n0,0,7,2.5,1\n", "line 2: has 5 columns"),
        ("0,0,7,2.5\n0,0,x,1\n", "line 2: expected rows of x1, y1, x2, y2, found 'x' in column 3"),
        ("a,b,c,d\n0,0,7,2.5\n", "line 1: expected rows of x1, y1, x2, y2, or a row of these names, found a, b, c"),
    ],
)  # fmt: skip
def test_a_table_that_is_not_clear_is_refused_with_its_line(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(FormatError) as caught:
        read_map(tmp_path / "a.csv")
    assert said in str(caught.value)


def placed(x: float, y: float, scale: float = 1.0) -> dict[str, Any]:
    ring = [[x + scale * a, y + scale * b] for a, b in RING]
    return {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [ring]}}


@pytest.mark.parametrize(
    ("where", "crs", "options", "said"),
    [
        ((692000, 5336000, 1), "urn:ogc:def:crs:EPSG::32632", {}, None),
        ((4e5, 1e5, 1), "EPSG:27700", {}, None),
        ((692000, 5336000, 1), None, {}, "are no degrees, such as"),
        ((1847903, 6300000, 1.53), "urn:ogc:def:crs:EPSG::3857", {"local_metres": True}, "1.529 times too large"),
        ((1847903, 6300000, 1.53), "EPSG:3857", {"units": "m"}, "EPSG:32633"),
        ((1847903, 6300000, 1 / 0.654), "EPSG:3857", {"units": 0.654}, None),
        ((0, 0, 3.28), "urn:ogc:def:crs:EPSG::2263", {"local_metres": True}, "units to us-ft"),
        ((0, 0, 1 / 0.3048006096), "EPSG:2263", {"units": "us-ft"}, None),
        ((9e5, 2e5, 1), "EPSG:54321", {}, "EPSG:54321, whose unit is not known"),
        ((9e5, 2e5, 1), "EPSG:54321", {"local_metres": True}, None),
        ((16.6, 49.2, 1e-5), "urn:ogc:def:crs:OGC:1.3:CRS84", {}, "has degrees, such as 16.6"),
        ((-70.6, -33.4, 1e-5), None, {"local_metres": True}, "EPSG:32719"),
        ((0, 0, 1), None, {}, "set the option local_metres"),
    ],
)
def test_the_coordinate_system_of_a_geojson(
    tmp_path: Path, where: tuple[float, float, float], crs: str | None, options: dict[str, Any], said: str | None
) -> None:
    path = geojson(tmp_path, placed(*where), crs=crs)
    if said is not None:
        with pytest.raises(IncompleteFileError) as caught:
            read_map(path, ImportOptions(**options))
        assert said in str(caught.value)
        return
    imported = read_map(path, ImportOptions(drawn="faces", **options))
    assert sum(imported.map.segments.lengths) == pytest.approx(24.0, abs=1e-4)
    assert ("crs" in noted(imported)) == bool(options)


def test_features_on_lines_of_their_own(tmp_path: Path) -> None:
    (tmp_path / "a.geojson").write_text("\n".join(f"\x1e{json.dumps(feature(y))}" for y in (1, 2)))
    assert len(rows(read_map(tmp_path / "a.geojson", METRES))) == 2


def test_an_option_that_says_nothing_of_a_file_is_refused(tmp_path: Path) -> None:
    path = geojson(tmp_path, feature(1))
    (tmp_path / "a.json").write_text("[[0, 0, 1, 0]]")
    for file, options in (
        (path, ImportOptions(surface=0.0)),
        (tmp_path / "a.json", ImportOptions(level="1")),
        (tmp_path / "a.yaml", ImportOptions(where=("a=b",))),
    ):
        with pytest.raises(InvalidOptionError, match="omit it"):
            read_map(file, options)


def dashed(tmp_path: Path, kind: str) -> Path:
    """Return a drawing of three lines. Two have dashes: one has its own style, one that of its layer or group."""
    if kind == "svg":
        styled = '<line x1="0" y1="2" x2="5" y2="2" stroke="red" style="stroke-dasharray: 4 2"/>'
        plain = '<line x1="0" y1="0" x2="5" y2="0" stroke="red" stroke-dasharray="none"/>'
        inner = '<g stroke-dasharray="3"><line x1="0" y1="4" x2="5" y2="4" stroke="red"/></g>'
        return svg(tmp_path, plain + styled + inner)
    document = new(setup=True)
    document.linetypes.add("HIDDEN", [0.3, 0.2, -0.1])
    document.layers.add("BEAMS", linetype="HIDDEN")
    for y, attributes in enumerate(({}, {"linetype": "DASHED2"}, {"layer": "BEAMS"})):
        document.modelspace().add_line((0.0, 2.0 * y), (5.0, 2.0 * y), dxfattribs=attributes)
    document.saveas(tmp_path / "plan.dxf")
    return tmp_path / "plan.dxf"


def test_lines_of_a_block_are_dashed_as_its_reference(tmp_path: Path) -> None:
    document = new(setup=True)
    document.linetypes.add("HIDDEN", [0.3, 0.2, -0.1])
    document.layers.add("BEAMS", linetype="DASHED")
    inner, outer = document.blocks.new("INNER"), document.blocks.new("OUTER")
    inner.add_line((0.0, 0.0), (5.0, 0.0), dxfattribs={"linetype": "ByBlock"})
    inner.add_line((0.0, 1.0), (5.0, 1.0))  # as the layer of the reference
    inner.add_line((0.0, 2.0), (5.0, 2.0), dxfattribs={"linetype": "CONTINUOUS"})
    outer.add_blockref("INNER", (0.0, 0.0), {"linetype": "BYBLOCK"})
    for k, attributes in enumerate(({}, {"linetype": "HIDDEN"}, {"layer": "BEAMS"}, {"linetype": "BYBLOCK"})):
        document.modelspace().add_blockref("OUTER", (0.0, 10.0 * k), attributes)
    document.saveas(tmp_path / "plan.dxf")
    found = read_map(tmp_path / "plan.dxf", ImportOptions(units="m", drawn="faces"))
    seen = sorted({round(float(y)) for y in found.map.segments.endpoints[:, 1]})
    assert seen == [0, 1, 2, 11, 12, 22, 30, 31, 32]


@pytest.mark.parametrize(
    ("kind", "key", "told"),
    [("dxf", "linetype", ("linetype=DASHED2", "linetype=HIDDEN")), ("svg", "stroke-dasharray", ("=4 2", "=3"))],
)
def test_dashed_lines_are_left_out_and_can_be_chosen(
    tmp_path: Path, kind: str, key: str, told: tuple[str, ...]
) -> None:
    path = dashed(tmp_path, kind)
    found = read_map(path, ImportOptions(units="m"))
    assert len(found.map.segments) == 1
    note = next(one for one in found.report.dropped if one.code == "not_seen")
    assert note.count == 2
    assert all(one in note.message for one in told)
    assert "set the option where" in note.message
    pattern = "*" if kind == "svg" else "D*"
    chosen = read_map(path, ImportOptions(units="m", where=(f"{key}={pattern}",)))
    assert len(chosen.map.segments) == (3 if kind == "svg" else 1)
