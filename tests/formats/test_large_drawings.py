"""Text formats of a few megabytes that would unpack to gigabytes, or that hold nothing: one clear error, in bounds."""

from __future__ import annotations

from pathlib import Path

import pytest

from formats import FormatError, ImportOptions, MalformedFileError, TooLargeError, read_map

OPTIONS = ImportOptions(local_metres=True, units="m", drawn="faces")
FEATURES = b'{"type": "FeatureCollection", "features": [%s]}'
LINE = b'{"type": "LineString", "coordinates": %s}'


@pytest.mark.parametrize(
    ("name", "content", "kind", "message"),
    [
        ("a.geojson", FEATURES % (b"{}," * 8_000_000 + b"{}"), TooLargeError, "6000000 values"),
        ("a.geojson", FEATURES % (b"{}," * 900_000 + b"{}"), TooLargeError, "500000 features"),
        ("a.geojson", FEATURES % (b"{}," * 900 + b"{}"), MalformedFileError, "has no lines"),
        ("a.geojson", FEATURES % b"", MalformedFileError, "has no lines"),
        ("a.geojson", LINE % b"[]", MalformedFileError, "has no lines"),
        ("a.geojson", LINE % b"[[0, 0]]", MalformedFileError, "has no lines"),
        ("a.geojson", LINE % b"[[0, 0], [1e400, 0]]", MalformedFileError, "not a number|is not JSON"),
        ("a.geojson", LINE % b"[[0, 0], [NaN, 0]]", MalformedFileError, "is not JSON"),
        ("a.geojson", LINE % b"[[0, 0], [null, 0]]", MalformedFileError, "not a number"),
        ("a.geojson", LINE % b"[[0, 0], []]", MalformedFileError, "not [x, y]"),
        ("a.geojson", LINE % b'[[0, 0], "ab"]', MalformedFileError, "not a number"),
        ("a.geojson", LINE % (b"[" * 900 + b"]" * 900), MalformedFileError, "not [x, y]|not a number"),
        ("a.geojson", b'{"type": "Feature", "geometry": null}', MalformedFileError, "feature without geometry"),
        ("a.geojson", b'{"type": "Point", "coordinates": [0, 0]}', MalformedFileError, "Point is not read (1)"),
        ("a.json", b"[" + b"[0,0,1,1]," * 2_000_000 + b"[0,0,1,1]]", TooLargeError, "6000000 values"),
        ("a.json", b"[" + b"0," * 7_000_000 + b"0]", TooLargeError, "6000000 values"),
        ("a.json", b'{"segments": [[0, 0, 1e400, 1]]}', MalformedFileError, "not a number|is not JSON"),
        ("a.csv", b"\n" * 3_000_000, TooLargeError, "1000000 lines"),
        ("a.csv", b"\r" * 3_000_000, TooLargeError, "1000000 lines"),
        ("a.csv", b"," * 3_000_000, TooLargeError, "10000 characters"),
        ("a.csv", b"0,0,1,1\n" * 600_000, TooLargeError, "500000 lines"),
        ("a.csv", b"0,0,1,inf\n", MalformedFileError, "not a number up to"),
        ("a.csv", b"0,0,1,1e400\n", MalformedFileError, "not a number up to"),
        ("a.csv", "0,0,1,1\n".encode("utf-16"), MalformedFileError, "UTF-8"),
        ("a.csv", b"\xff\xfe0", MalformedFileError, "UTF-8"),
        ("a.csv", b"", MalformedFileError, "expected rows|has no lines"),
        ("a.csv", b"0,0,1,\x001\n", MalformedFileError, "expected rows"),
        ("a.svg", b"<svg>" + b"<g/>" * 600_000 + b"</svg>", TooLargeError, "500000 elements"),
    ],
)
def test_refused_in_one_line(tmp_path: Path, name: str, content: bytes, kind: type[FormatError], message: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(kind) as caught:
        read_map(tmp_path / name, OPTIONS)
    assert any(part in str(caught.value) for part in message.split("|")), str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["a.json", "a.geojson", "a.csv"])
def test_a_byte_order_mark(tmp_path: Path, name: str) -> None:
    content = {
        "a.json": b"[[0, 0, 4, 0]]",
        "a.geojson": LINE % b"[[0, 0], [4, 0]]",
        "a.csv": b"x1,y1,x2,y2\r\n0,0,4,0\r\n",
    }[name]
    (tmp_path / name).write_bytes(b"\xef\xbb\xbf" + content)
    assert read_map(tmp_path / name, OPTIONS).map.segments.endpoints.tolist() == [[0, 0, 4, 0]]


def test_widths_that_are_no_lengths_are_none(tmp_path: Path) -> None:
    feature = b'{"type": "Feature", "properties": {"width": %s}, "geometry": ' + LINE % b"[[0, 0], [4, 0]]" + b"}"
    for width in (b"true", b"-1", b"1e300", b'"wide"', b"{}"):
        (tmp_path / "a.geojson").write_bytes(feature % width)
        found = read_map(tmp_path / "a.geojson", ImportOptions(local_metres=True, drawn="centres"))
        assert "thickness_usual" in {note.code for note in found.report.assumed}
