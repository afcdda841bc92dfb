"""A form as the bounded process reads it: its parts, the options in its fields, and its faults."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from formats import GridPicture
from linefix.documents.errors import InvalidRequestError
from registration import RigidTransform
from service.errors import FileTooLargeError, UnknownFormatError
from service.importing.fields import options_of
from service.importing.form import MOST_PARTS, read_form
from service.importing.reader import MOST_PIXELS, Bounds, picture_json, read_files, read_scans

from .forms import SQUARE, TYPE, YAML, form

BOUNDS = Bounds(1_000_000_000, 32_000_000, 200_000)
LOG = b"FLASER 3 1.0 2.0 3.0 0 0 0 0 0 0 100.0 robot 100.0\n"
A_MAP, A_LOG = {"a.csv": SQUARE}, {"a.log": LOG}


def with_fields(*fields: tuple[str, str]) -> bytes:
    return bytes(form(A_MAP, *fields))


def of_log(*fields: tuple[str, str]) -> bytes:
    return bytes(form(A_LOG, *fields))


NO_FORM, NO_NAME = "is not multipart/form-data", "expected a file name"
# A form, and how its one fault begins: pointer and message.
MAPS: dict[str, tuple[Iterable[int], str]] = {
    "text": (b"no form at all", NO_FORM),
    "cut short": (form(A_MAP)[:-20], NO_FORM),
    "no name": (form(A_MAP).replace(b"name=", b"nom="), NO_FORM),
    "too many parts": (form({f"{k}": b"" for k in range(MOST_PARTS + 1)}), "expected at most 64 parts"),
    "one name twice": (form({"x/a": b"1", "y/a": b"2"}), "the same name"),
    "a name of dots": (form({"..": b"1"}), NO_NAME),
    "a long name": (form({"n" * 201: b"1"}), NO_NAME),
    "a long field": (with_fields(("units", "m" * 1001)), "at most 1000 bytes"),
    "bytes that are no text": (with_fields(("units", "m")).replace(b"units", b"\xff\xfe"), "UTF-8"),
    "no file": (form({}), "/files: expected a file"),
    "two maps": (form({"a.csv": SQUARE, "b.csv": SQUARE}), "/files: expected one map and the files that it names"),
    "no picture": (form({"a.yaml": YAML % b"b.pgm"}), "/files: the map names a file that was not sent"),
    "an empty picture": (form({"a.yaml": YAML % b"a.png", "a.png": b""}), "/files/1: is not a picture"),
    "deep JSON": (form({"deep.json": b"[" * 100_000}), "/files/0: is not JSON"),
    "a broken bag": (form({"a.db3": b"", "metadata.yaml": b"rosbag2_bagfile_information: {"}), "/files: is a broken"),
    "an unknown field": (with_fields(("unit", "m")), "/unit: unknown field; expected one of units"),
    "units": (with_fields(("units", "parsec")), "/units: expected one of mm, cm"),
    "no number as units": (with_fields(("units", "nan")), "metres per unit"),
    "two units": (with_fields(("units", "m"), ("units", "cm")), "/units: expected this field once"),
    "one coordinate": (with_fields(("point", "1")), "/point: expected 2 numbers"),
    "an infinite point": (with_fields(("point", "1 inf")), "/point: expected two numbers"),
    "a point that lies outside": (with_fields(("point", "99 99")), "/point/0: lies on a line or outside"),
    "thickness": (with_fields(("thickness", "thick")), "/thickness: expected a number"),
    "drawn": (with_fields(("drawn", "somehow")), "/drawn: expected faces or centres"),
    "local_metres": (with_fields(("local_metres", "perhaps")), "/local_metres: expected true or false"),
    "where": (with_fields(("where", "indoor")), "/where: expected property=value"),
    "two levels": (with_fields(("level", "1"), ("level", "2")), "/level: expected this field once"),
    "surface": (with_fields(("surface", "11")), "from 0 to 10 cells"),
    "unknown": (with_fields(("unknown", "grey")), "/unknown: expected none, or a grey value from 0 to 255"),
}  # fmt: skip
LOGS: dict[str, tuple[Iterable[int], str]] = {
    "two logs": (form({"a.log": LOG, "b.log": LOG}), "/files: expected one log"),
    "no log": (form({}), "/files: expected a file, found none"),
    "a log that is broken": (form({"a.bag": b"no bag"}), "/files/0: "),
    "no scans": (of_log(("max_scans", "0")), "/max_scans: expected an integer from 1 to 1000"),
    "a field of maps": (of_log(("units", "m")), "/units: unknown field"),
    "two topics": (of_log(("topic", "a"), ("topic", "b")), "/topic: expected this field once"),
}


@pytest.mark.parametrize("kind", [*MAPS, *LOGS])
def test_what_is_wrong_is_named(tmp_path: Path, kind: str) -> None:
    content, said = {**MAPS, **LOGS}[kind]
    read = partial(read_files, bounds=BOUNDS) if kind in MAPS else read_scans
    with pytest.raises(InvalidRequestError) as caught:
        read(bytes(content), TYPE, tmp_path)
    (fault,) = caught.value.faults
    told = f"{fault.pointer}: {fault.message}"
    assert told.startswith(said) if said.startswith("/") else said in told


def test_a_form_has_a_boundary(tmp_path: Path) -> None:
    with pytest.raises(InvalidRequestError, match="boundary"):
        read_files(bytes(form(A_MAP)), "multipart/form-data", tmp_path, BOUNDS)


def test_files_and_fields_come_apart_to_the_byte() -> None:
    """A name loses its folders."""
    content = bytes(range(256)) * 300 + b"\r\n--3d6\r\n\r\n"
    files = {"/etc/../a.pgm": content, "C:\\maps\\b.yaml": b"", "maps/plän x.dxf": b"x"}
    found = read_form(bytes(form(files, ("layers", "A*"), ("layers", "B"))), TYPE)
    kept = {"a.pgm": content, "b.yaml": b"", "plän x.dxf": b"x"}
    assert {name: bytes(data) for name, data in found.files.items()} == kept
    assert found.fields == {"layers": ["A*", "B"]}


OPTIONS = {
    "units": (["0.0254"], 0.0254), "layers": (["*WALL*, A-*", "B"], ("*WALL*", "A-*", "B")),
    "point": (["1 2.5", "-3,4"], ((1.0, 2.5), (-3.0, 4.0))), "drawn": (["centres"], "centres"),
    "thickness": (["0.2"], 0.2), "oriented": (["false"], False), "local_metres": (["true"], True),
    "where": (["indoor=wall", "layer=A, B"], ("indoor=wall", "layer=A, B")), "level": ([" 1 "], "1"),
    "surface": (["0.5"], 0.5),
}  # fmt: skip


def test_fields_are_options() -> None:
    options = options_of({name: sent for name, (sent, _) in OPTIONS.items()})
    assert {name: getattr(options, name) for name in OPTIONS} == {name: meant for name, (_, meant) in OPTIONS.items()}
    assert options_of({"units": ["ft"]}).units == "ft"


def test_a_form_becomes_a_report_and_a_map(tmp_path: Path) -> None:
    told, found = read_files(with_fields(("point", "1 1")), TYPE, tmp_path, BOUNDS)
    assert (told["picture"], told["report"]["format"], told["report"]["files"]) == (None, "csv", ("a.csv",))
    assert (found["segments"].shape, found["oriented"], found["meta"]) == ((4, 4), True, {"source": "a.csv"})


def test_what_is_no_fault_of_the_form_is_reported(tmp_path: Path) -> None:
    """More segments than a map may have, and a map in the place of a log."""
    with pytest.raises(FileTooLargeError, match=r"^expected at most 3 segments, found 4"):
        read_files(with_fields(), TYPE, tmp_path, replace(BOUNDS, segments=3))
    with pytest.raises(UnknownFormatError, match=r"^found no log; expected a file that ends in one of \.bag"):
        read_scans(bytes(form({"plan.dxf": b"0"})), TYPE, tmp_path)


def test_a_large_picture_is_reduced_and_stays_in_its_place() -> None:
    """A mark in the highest row, whose place does not change by more than a pixel."""
    rows, pose = 2 * MOST_PIXELS + 1, RigidTransform(4.0, -3.0, 0.5)
    pixels = np.full((rows, 30), 255, np.uint8)
    pixels[:3] = 0
    found = picture_json(GridPicture(pixels, pose, 0.1))
    image = np.asarray(Image.open(io.BytesIO(base64.b64decode(found["png"]))))
    assert max(image.shape) <= MOST_PIXELS
    assert image[0, 0] == 0
    assert (found["resolution"], found["pose"]["theta"]) == (pytest.approx(0.3), 0.5)
    top = RigidTransform(**found["pose"]).apply(np.array([[0.0, image.shape[0] * found["resolution"]]]))
    assert top == pytest.approx(pose.apply(np.array([[0.0, 0.1 * rows]])), abs=1e-9)
