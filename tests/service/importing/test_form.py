"""Forms taken apart, and what their fields say."""

from __future__ import annotations

import pytest

from linefix.documents.errors import InvalidRequestError
from service.importing.fields import options_of
from service.importing.form import MOST_PARTS, read_form

from .forms import TYPE, form


def faults(error: InvalidRequestError) -> list[tuple[str, str]]:
    return [(fault.pointer, fault.message) for fault in error.faults]


def test_files_and_fields_come_apart_to_the_byte() -> None:
    content = bytes(range(256)) * 300 + b"\r\n--3d6\r\n\r\n"
    found = read_form(bytes(form({"a.pgm": content, "b.yaml": b""}, ("layers", "A*"), ("layers", "B"))), TYPE)
    assert {name: bytes(data) for name, data in found.files.items()} == {"a.pgm": content, "b.yaml": b""}
    assert found.fields == {"layers": ["A*", "B"]}


@pytest.mark.parametrize(
    ("sent", "kept"),
    [("/etc/../x.yaml", "x.yaml"), ("C:\\maps\\x.yaml", "x.yaml"), ("maps/plän x.dxf", "plän x.dxf")],
    ids=["folders", "folders of Windows", "letters"],
)
def test_a_name_loses_its_folders(sent: str, kept: str) -> None:
    assert list(read_form(bytes(form({sent: b"x"})), TYPE).files) == [kept]


@pytest.mark.parametrize(
    ("content", "media_type", "said"),
    [
        (form({"a": b""}), "multipart/form-data", "boundary"),
        (b"no form at all", TYPE, "is not multipart/form-data"),
        (form({"a": b"x"})[:-20], TYPE, "is not multipart/form-data"),
        (form({f"{k}": b"" for k in range(MOST_PARTS + 1)}), TYPE, "at most 64 parts"),
        (form({"a": b""}).replace(b"name=", b"nom="), TYPE, "is not multipart/form-data"),
        (form({"x/a": b"1", "y/a": b"2"}), TYPE, "the same name"),
        (form({"..": b"1"}), TYPE, "expected a file name"),
        (form({"n" * 201: b"1"}), TYPE, "expected a file name"),
        (form({}, ("units", "m" * 1001)), TYPE, "at most 1000 bytes"),
        (form({}, ("units", "m")).replace(b"units", b"\xff\xfe"), TYPE, "UTF-8"),
    ],
    ids=["boundary", "text", "cut short", "parts", "no name", "twice", "dots", "long name", "long field", "bytes"],
)
def test_what_is_no_form_is_refused(content: bytes, media_type: str, said: str) -> None:
    with pytest.raises(InvalidRequestError) as caught:
        read_form(bytes(content), media_type)
    assert said in caught.value.faults[0].message


def test_fields_are_options() -> None:
    fields = {
        "units": ["0.0254"],
        "layers": ["*WALL*, A-*", "B"],
        "point": ["1 2.5", "-3,4"],
        "drawn": ["centres"],
        "thickness": ["0.2"],
        "oriented": ["false"],
        "local_metres": ["true"],
        "where": ["indoor=wall", "layer=A, B"],
        "level": [" 1 "],
        "surface": ["0.5"],
    }
    options = options_of(fields)
    assert (options.units, options.layers, options.point) == (
        0.0254,
        ("*WALL*", "A-*", "B"),
        ((1.0, 2.5), (-3.0, 4.0)),
    )
    assert (options.drawn, options.thickness, options.local_metres) == ("centres", 0.2, True)
    assert options.oriented is False
    assert (options.where, options.level, options.surface) == (("indoor=wall", "layer=A, B"), "1", 0.5)
    assert options_of({"units": ["ft"]}).units == "ft"


@pytest.mark.parametrize(
    ("name", "values", "said"),
    [
        ("unit", ["m"], "expected one of units"),
        ("units", ["parsec"], "mm, cm"),
        ("units", ["nan"], "metres per unit"),
        ("units", ["m", "cm"], "once"),
        ("point", ["1"], "2 numbers"),
        ("point", ["1 inf"], "two numbers"),
        ("thickness", ["thick"], "a number"),
        ("drawn", ["somehow"], "faces or centres"),
        ("local_metres", ["perhaps"], "true or false"),
        ("where", ["indoor"], "property=value"),
        ("level", ["1", "2"], "once"),
        ("surface", ["11"], "from 0 to 10 cells"),
        ("unknown", ["grey"], "expected none, or a grey value from 0 to 255"),
    ],
    ids=str,
)
def test_a_field_that_is_wrong_is_named(name: str, values: list[str], said: str) -> None:
    with pytest.raises(InvalidRequestError) as caught:
        options_of({name: values})
    ((pointer, message),) = faults(caught.value)
    assert pointer == f"/{name}"
    assert said in message
