"""Files that are no drawing, hold nothing, or would unpack from megabytes to gigabytes: one clear error, in bounds."""

from __future__ import annotations

from pathlib import Path

import pytest

from formats import FormatError, ImportOptions, MalformedFileError, TooLargeError, UnsupportedFormatError, read_map

from .reading import feature, geojson, notes, rows, written

LONG = pytest.mark.long
OPTIONS = ImportOptions(local_metres=True, units="m", drawn="faces")
FEATURES = b'{"type": "FeatureCollection", "features": [%s]}'
SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 10 10">{}</svg>'
NESTED_SVG = "<g>" * 70 + "</g>" * 70
LAUGHS = '<!DOCTYPE svg [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;">]>' + SVG.format("&b;")
DEEP = '{"type": "GeometryCollection", "geometries": [' * 8 + "]}" * 8
LINE = b'{"type": "LineString", "coordinates": %s}'


@pytest.mark.parametrize(
    ("name", "content", "kind", "message"),
    [
        ("a.dxf", "  \n", MalformedFileError, "is empty"),
        ("a.dxf", "nothing of the kind", MalformedFileError, "is not a DXF"),
        ("a.dxf", "AC1032\0\0\0", UnsupportedFormatError, "save it as DXF"),
        ("a.svg", "<svg", MalformedFileError, "is not XML"),
        ("a.svg", "<kml/>", MalformedFileError, "expected an svg element"),
        ("a.svg", LAUGHS, MalformedFileError, "declares XML entities"),
        ("a.svg", SVG.format(NESTED_SVG), TooLargeError, "64 in one another"),
        ("a.svg", SVG.format('<path d="' + "M0 0" * 1_100_000 + '"/>'), TooLargeError, "characters of paths"),
        ("a.svg", SVG.format('<line x1="nan" x2="1"/>'), MalformedFileError, "is 'nan', expected a number"),
        ("a.svg", SVG.format('<line x1="1e" x2="1"/>'), MalformedFileError, "line 1: x1 of a line element"),
        ("a.svg", SVG.format("<text/>"), MalformedFileError, "has no lines"),
        ("a.geojson", "[1, 2]", MalformedFileError, "is not GeoJSON"),
        ("a.geojson", '{"type": "LineString", "coordinates": [["a", 1], [2, 3]]}', MalformedFileError, "not a number"),
        ("a.geojson", '{"type": "LineString", "coordinates": [1, 2]}', MalformedFileError, "not [x, y]"),
        ("a.geojson", DEEP, MalformedFileError, "nested collections"),
        ("a.json", "[" * 5000, MalformedFileError, "is not JSON"),
        ("a.json", '{"segments": [[0, 0, 1]]}', MalformedFileError, "[x1, y1, x2, y2]"),
        ("a.json", '{"segments": [[0, 0, 1, true]]}', MalformedFileError, "[x1, y1, x2, y2]"),
        ("a.json", '{"segments": [[0, 0, 1e10, 0]]}', MalformedFileError, "beyond 1e+09 m; check the unit"),
        ("a.json", '{"segments": [[0, 0, 1, 0]], "sigma": -1}', MalformedFileError, "sigma"),
        ("a.csv", "0,0,4\n", MalformedFileError, "expected rows"),
        ("a.csv", "0;0;7.000;0\n7.000;0;7.000;950\n", MalformedFileError, "expected 7000, or decimals"),
        ("a.csv", "0,0,4,nan\n", MalformedFileError, "not a number up to 1e+13"),
        ("a.csv", "\xff", MalformedFileError, "has no lines|UTF-8|expected rows"),
        ("a.osm", "", UnsupportedFormatError, "found .osm; save it as GeoJSON, in UTM"),
        ("a.gpkg", "SQLite format 3", UnsupportedFormatError, "is a GeoPackage; save it as GeoJSON"),
        ("a.json", '{"type": "Feature", "geometry": null}', MalformedFileError, "its name has to end in .geojson"),
        pytest.param("a.geojson", FEATURES % (b"{}," * 8_000_000 + b"{}"), TooLargeError, "6000000 values", marks=LONG),
        ("a.geojson", FEATURES % (b"{}," * 900_000 + b"{}"), TooLargeError, "500000 features"),
        ("a.geojson", FEATURES % (b"{}," * 900 + b"{}"), MalformedFileError, "has no lines"),
        ("a.geojson", LINE % b"[]", MalformedFileError, "has no lines"),
        ("a.geojson", LINE % b"[[0, 0]]", MalformedFileError, "has no lines"),
        ("a.geojson", LINE % b"[[0, 0], [1e400, 0]]", MalformedFileError, "not a number|is not JSON"),
        ("a.geojson", LINE % b"[[0, 0], [NaN, 0]]", MalformedFileError, "is not JSON"),
        ("a.geojson", LINE % b"[[0, 0], [null, 0]]", MalformedFileError, "not a number"),
        ("a.geojson", LINE % b'[[0, 0], "ab"]', MalformedFileError, "not a number"),
        ("a.geojson", LINE % (b"[" * 900 + b"]" * 900), MalformedFileError, "not [x, y]|not a number"),
        ("a.geojson", b'{"type": "Feature", "geometry": null}', MalformedFileError, "feature without geometry"),
        ("a.geojson", b'{"type": "Point", "coordinates": [0, 0]}', MalformedFileError, "Point is not read (1)"),
        pytest.param(
            "a.json", b"[" + b"[0,0,1,1]," * 2_000_000 + b"[0,0,1,1]]", TooLargeError, "6000000 values", marks=LONG
        ),
        ("a.json", b"[" + b"0," * 7_000_000 + b"0]", TooLargeError, "6000000 values"),
        ("a.json", b'{"segments": [[0, 0, 1e400, 1]]}', MalformedFileError, "not a number|is not JSON"),
        ("a.csv", b"\n" * 3_000_000, TooLargeError, "1000000 lines"),
        pytest.param("a.csv", b"\r" * 3_000_000, TooLargeError, "1000000 lines", marks=LONG),
        ("a.csv", b"," * 3_000_000, TooLargeError, "10000 characters"),
        pytest.param("a.csv", b"0,0,1,1\n" * 600_000, TooLargeError, "500000 lines", marks=LONG),
        ("a.csv", b"0,0,1,1e400\n", MalformedFileError, "not a number up to"),
        ("a.csv", "0,0,1,1\n".encode("utf-16"), MalformedFileError, "UTF-8"),
        ("a.csv", b"", MalformedFileError, "expected rows|has no lines"),
        pytest.param("a.svg", b"<svg>" + b"<g/>" * 600_000 + b"</svg>", TooLargeError, "500000 elements", marks=LONG),
    ],
)
def test_refused_in_one_line_that_names_the_file(
    tmp_path: Path, name: str, content: str | bytes, kind: type[FormatError], message: str
) -> None:
    with pytest.raises(kind) as caught:
        read_map(written(tmp_path, name, content), OPTIONS)
    assert any(part in str(caught.value) for part in message.split("|")), str(caught.value)
    assert str(caught.value).startswith(f"{name}: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.json", b"[[0, 0, 4, 0]]"),
        ("a.geojson", LINE % b"[[0, 0], [4, 0]]"),
        ("a.csv", b"x1,y1,x2,y2\r\n0,0,4,0\r\n"),
    ],
)
def test_a_byte_order_mark(tmp_path: Path, name: str, content: bytes) -> None:
    assert rows(read_map(written(tmp_path, name, b"\xef\xbb\xbf" + content), OPTIONS)) == [[0, 0, 4, 0]]


@pytest.mark.parametrize("width", [True, -1, 0.001, 3.0, 1e300, "wide", {}])
def test_widths_that_are_no_lengths_are_none(tmp_path: Path, width: object) -> None:
    path = geojson(tmp_path, feature([[0, 0], [4, 0]], width=width))
    assert "thickness_usual" in notes(read_map(path, ImportOptions(local_metres=True, drawn="centres")))
