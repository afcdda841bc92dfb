"""Drawings of which a part is the map: one floor of several, walls among doors and footways, columns of a table."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from ezdxf.filemanagement import new

from formats import FormatError, ImportOptions, IncompleteFileError, InvalidOptionError, MalformedFileError, read_map

from .reading import feature, geojson, notes, rows, saved, svg, written

METRES = ImportOptions(local_metres=True, drawn="faces")
FACES = ImportOptions(drawn="faces", units="m")
RING = [[0, 0], [7, 0], [7, 5], [0, 5], [0, 0]]


def line(y: float, *z: float, **properties: Any) -> dict[str, Any]:
    return feature([[0, y, *z], [4, y, *z]], **properties)


def drawn(tmp_path: Path, *lines: tuple[tuple[float, ...], tuple[float, ...]]) -> Path:
    document = new(units=6)
    for begin, end in lines:
        document.modelspace().add_line(begin, end)
    return saved(tmp_path, document)


def storeys(tmp_path: Path, kind: str) -> Path:
    """Return a file with a line at y = 1 on the lower floor, and one at y = 2 and y = 3 on the upper one."""
    if kind == "heights":
        return drawn(tmp_path, ((0, 1, 0), (4, 1, 0)), ((0, 2, 3.2), (4, 2, 3.2)), ((0, 3, 4.1), (4, 3, 4.1)))
    if kind == "svg":
        groups = (("Level 0", -1), ("1st floor", -2), ("1st floor", -3))
        text = '<g id="{0}"><line x2="4" y1="{1}" y2="{1}" stroke="black"/></g>'
        return svg(tmp_path, "".join(text.format(*group) for group in groups))
    if kind == "z of a table":
        return written(tmp_path, "a.csv", "x1,y1,z1,x2,y2,z2\n0,1,0,4,1,0\n0,2,3.2,4,2,3.2\n0,3,3.2,4,3,3.2\n")
    if kind == "csv":
        return written(tmp_path, "a.csv", "x1,y1,x2,y2,Level\n0,1,4,1,0\n0,2,4,2,3.2\n0,3,4,3,3.2\n")
    if kind == "z":
        return geojson(tmp_path, line(1, 0), line(2, 3.2), line(3, 3.2))
    return geojson(tmp_path, line(1, **{kind: "0"}), line(2, **{kind: 3.2}), line(3, **{kind: "-3;3.2"}))


@pytest.mark.parametrize(
    ("kind", "upper"),
    [(k, "3.2") for k in ("level", "level_id", "z", "heights", "csv", "z of a table")] + [("svg", "1st floor")],
)
def test_several_floors_are_a_question_that_an_option_answers(tmp_path: Path, kind: str, upper: str) -> None:
    path, options = storeys(tmp_path, kind), FACES
    with pytest.raises(IncompleteFileError, match=rf"levels, with lines: .*{upper} \(2\).*--level") as caught:
        read_map(path, options)
    assert "\n" not in str(caught.value)
    imported = read_map(path, replace(options, level=upper.upper()))
    assert sorted(row[1] for row in rows(imported)) == [2, 3]
    assert imported.map.meta["level"] == upper
    assert notes(imported)["other_level"].count == 1
    with pytest.raises(InvalidOptionError, match=r"found another name"):
        read_map(path, replace(options, level="7"))


def test_one_floor_is_no_question(tmp_path: Path) -> None:
    frame = [(a, b) for z in (0, 2.7) for a, b in (((0, 0, z), (4, 0, z)), ((4, 0, z), (4, 3, z)))]
    posts = [((x, y, 0), (x, y, 2.7)) for x, y in ((0, 0), (4, 0), (4, 3))]
    assert len(rows(read_map(drawn(tmp_path, *frame, *posts), FACES))) == 2
    assert len(rows(read_map(geojson(tmp_path, line(1, level="0-2"), line(2, level="0;1;2")), METRES))) == 2
    assert len(rows(read_map(geojson(tmp_path, line(1, level="2"), line(2)), METRES))) == 2
    with pytest.raises(InvalidOptionError, match="names no levels"):
        read_map(geojson(tmp_path, line(1)), ImportOptions(local_metres=True, level="0"))


def test_a_section_is_no_plan(tmp_path: Path) -> None:
    with pytest.raises(MalformedFileError, match=r"7 by 0 units in x and y, and 5 in z"):
        read_map(drawn(tmp_path, ((0, 0, 0), (7, 0, 0)), ((7, 0, 0), (7, 0, 5)), ((0, 0, 5), (7, 0, 5))), FACES)


def test_a_level_of_imdf_is_on_itself(tmp_path: Path) -> None:
    level = line(1, ordinal=0) | {"feature_type": "level", "id": "L1"}
    assert len(rows(read_map(geojson(tmp_path, level, line(2, level_id="L1")), METRES))) == 2


OSM = [
    line(1, indoor="wall"), line(2, highway="footway"), line(3, door="hinged"), line(4, indoor="area"),
    line(5) | {"feature_type": "opening"}, line(6, door="no", material=1), line(7, category="IfcDoor", level=2),
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
    message = notes(imported)[code].message
    assert all(part in message for part in said.split(", "))


def test_properties_of_dxf_csv_and_svg_choose_too(tmp_path: Path) -> None:
    document = new()
    for y, color in ((1, 1), (2, 3)):
        document.modelspace().add_line((0, y), (4, y), dxfattribs={"color": color})
    table = written(tmp_path, "a.csv", "name,x1,y1,x2,y2,color\na,0,1,4,1,1\nb,0,2,4,2,3\n")
    lines = (f'<line x2="4" y1="-{y}" y2="-{y}" stroke="black" color="{2 * y - 1}"/>' for y in (1, 2))
    for path in (saved(tmp_path, document), table, svg(tmp_path, "".join(lines))):
        imported = read_map(path, replace(FACES, where=("color=3",)))
        assert rows(imported) == [[0, 2, 4, 2]]


ONE, TWO = [[0, 0, 7, 2.5]], [[0, 0, 4, 0], [4, 0, 4, 3]]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("0,00;0,00;7,00;2,50\n", ONE), ("0,0 0,0 7,0 2,5\n", ONE), ('"0,0","0,0","7,0","2,5"', ONE),
        ("x1;y1;x2;y2\n0,0;0;7;2,5\n", ONE), ("0,0,7,2.5,A-WALL\n", ONE),
        ("start_x,start_y,end_x,end_y\n0,0,7,2.5\n", ONE), ("x0,y0,x1,y1\n0,0,7,2.5\n", ONE),
        ("x1_mm,y1_mm,x2_mm,y2_mm\n0,0,7000,2500\n", ONE), ("A\t0\t0\t7\t2.5\n", ONE),
        ("x1;y1;x2;y2\n0;\u22120;7;2.5\n", ONE), ("% walls\nP1X|P1Y|P2X|P2Y\n0|0|7|2.5\n|||\n", ONE),
        ("x1,y1,x2,y2,Layer\n0,0,7,2.5,A-WALL\n0,3,2,3,A-FURN\n", ONE), ("0,0,7,2.5,wall\n0,3,2,3,door\n", ONE),
        ("0,0,4,0\n4,0,4,3\n", TWO), ("x1;y1;x2;y2\n0;0;4;0\n4;0;4;3", TWO),
        ("name\ty2\tx2\ty1\tx1\nw\t0\t4\t0\t0\nw\t3\t4\t0\t4\n", TWO),
        ("# a comment\n\n0 0 4 0\n4 0 4 3\n", TWO),
    ],
)  # fmt: skip
def test_tables_of_spreadsheets_and_programs(tmp_path: Path, text: str, expected: list[list[float]]) -> None:
    assert rows(read_map(written(tmp_path, "a.csv", text))) == expected


def test_a_unit_in_the_names_of_columns_makes_a_wall_too_short_unless_an_option_states_metres(tmp_path: Path) -> None:
    path = written(tmp_path, "a.csv", "id,X1 [mm],Y1 [mm],X2 [mm],Y2 [mm]\n9,0,0,7,2.5\n")
    assert rows(read_map(path, ImportOptions(units="m"))) == ONE
    with pytest.raises(FormatError, match=r"no line of 0.01 m"):
        read_map(path)


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
    with pytest.raises(FormatError) as caught:
        read_map(written(tmp_path, "a.csv", text))
    assert said in str(caught.value)


PROJECTED = (
    "urn:ogc:def:crs:EPSG::32632", "http://www.opengis.net/def/crs/EPSG/0/25832", "epsg:25832+5783",
    "WGS 84 / UTM zone 32N", {"type": "EPSG", "properties": {"code": 25832}},
)  # fmt: skip


def placed(x: float, y: float, scale: float = 1.0) -> dict[str, Any]:
    return feature([[[x + scale * a, y + scale * b] for a, b in RING]], "Polygon")


@pytest.mark.parametrize(
    ("where", "crs", "options", "said"),
    [
        *(((692000, 5336000, 1), crs, {}, None) for crs in PROJECTED),
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
    tmp_path: Path, where: tuple[float, float, float], crs: Any, options: dict[str, Any], said: str | None
) -> None:
    named = {"type": "name", "properties": {"name": crs}} if isinstance(crs, str) else crs
    path = geojson(tmp_path, placed(*where), **({} if crs is None else {"crs": named}))
    if said is not None:
        with pytest.raises(IncompleteFileError) as caught:
            read_map(path, ImportOptions(**options))
        assert said in str(caught.value)
        return
    imported = read_map(path, ImportOptions(drawn="faces", **options))
    assert sum(imported.map.segments.lengths) == pytest.approx(24.0, abs=1e-4)
    assert ("crs" in notes(imported)) == bool(options)


def test_an_option_that_says_nothing_of_a_file_is_refused(tmp_path: Path) -> None:
    for file, options in (
        (geojson(tmp_path, line(1)), ImportOptions(surface=0.0)),
        (written(tmp_path, "a.json", "[[0, 0, 1, 0]]"), ImportOptions(level="1")),
        (tmp_path / "a.yaml", ImportOptions(where=("a=b",))),
    ):
        with pytest.raises(InvalidOptionError, match="omit it"):
            read_map(file, options)


def with_dashes() -> Any:
    document = new(setup=True)
    document.linetypes.add("HIDDEN", [0.3, 0.2, -0.1])
    document.layers.add("BEAMS", linetype="HIDDEN")
    return document


def dashed(tmp_path: Path, kind: str) -> Path:
    """Return a drawing of three lines. Two have dashes: one has its own style, one that of its layer or group."""
    if kind == "svg":
        line = '<line x2="5" y1="{0}" y2="{0}" stroke="red" {1}/>'
        styles = 'stroke-dasharray="none"', 'style="stroke-dasharray: 4 2"'
        plain, styled = (line.format(2 * k, style) for k, style in enumerate(styles))
        return svg(tmp_path, f'{plain}{styled}<g stroke-dasharray="3">{line.format(4, "")}</g>')
    document = with_dashes()
    for y, attributes in enumerate(({}, {"linetype": "DASHED2"}, {"layer": "BEAMS"})):
        document.modelspace().add_line((0.0, 2.0 * y), (5.0, 2.0 * y), dxfattribs=attributes)
    return saved(tmp_path, document)


def test_lines_of_a_block_are_dashed_as_its_reference(tmp_path: Path) -> None:
    document = with_dashes()
    inner, outer = document.blocks.new("INNER"), document.blocks.new("OUTER")
    inner.add_line((0.0, 0.0), (5.0, 0.0), dxfattribs={"linetype": "ByBlock"})
    inner.add_line((0.0, 1.0), (5.0, 1.0))  # as the layer of the reference
    inner.add_line((0.0, 2.0), (5.0, 2.0), dxfattribs={"linetype": "CONTINUOUS"})
    outer.add_blockref("INNER", (0.0, 0.0), {"linetype": "BYBLOCK"})
    for k, attributes in enumerate(({}, {"linetype": "HIDDEN"}, {"layer": "BEAMS"}, {"linetype": "BYBLOCK"})):
        document.modelspace().add_blockref("OUTER", (0.0, 10.0 * k), attributes)
    found = read_map(saved(tmp_path, document), FACES)
    assert sorted({round(y) for _, y, *_ in rows(found)}) == [0, 1, 2, 11, 12, 22, 30, 31, 32]


@pytest.mark.parametrize(
    ("kind", "key", "told"),
    [("dxf", "linetype", ("linetype=DASHED2", "linetype=HIDDEN")), ("svg", "stroke-dasharray", ("=4 2", "=3"))],
)
def test_dashed_lines_are_left_out_unless_chosen(tmp_path: Path, kind: str, key: str, told: tuple[str, ...]) -> None:
    path = dashed(tmp_path, kind)
    found = read_map(path, ImportOptions(units="m"))
    assert len(found.map.segments) == 1
    note = notes(found)["not_seen"]
    assert note.count == 2
    assert all(one in note.message for one in told)
    assert "set the option where" in note.message
    pattern = "*" if kind == "svg" else "D*"
    chosen = read_map(path, ImportOptions(units="m", where=(f"{key}={pattern}",)))
    assert len(chosen.map.segments) == (3 if kind == "svg" else 1)
