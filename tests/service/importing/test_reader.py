"""Result of the bounded process for a form."""

from __future__ import annotations

from pathlib import Path

import pytest

from service.importing.reader import Bounds, read_files
from service.schemas.errors import InvalidRequestError

from .forms import SQUARE, TYPE, YAML, form

BOUNDS = Bounds(1_000_000_000, 32_000_000, 200_000)


@pytest.mark.parametrize(
    ("files", "fields", "said"),
    [
        ({}, (), "/files: expected a file"),
        ({"a.csv": SQUARE, "b.csv": SQUARE}, (), "/files: expected one map and the files that it names"),
        ({"a.yaml": YAML % b"b.pgm"}, (), "/files: the map names a file that was not sent"),
        ({"a.yaml": YAML % b"a.png", "a.png": b""}, (), "/files/1: is not a picture"),
        ({"deep.json": b"[" * 100_000}, (), "/files/0: is not JSON"),
        ({"a.csv": SQUARE}, (("unit", "m"),), "/unit: unknown field; expected one of"),
        ({"a.csv": SQUARE}, (("point", "99 99"),), "/point/0: lies on a line or outside"),
        ({"a.db3": b"no database", "metadata.yaml": b"rosbag2_bagfile_information: {"}, (), "/files: is a broken bag"),
    ],
    ids=["none", "two maps", "no picture", "empty picture", "deep JSON", "field", "point", "bag"],
)
def test_what_is_wrong_is_named(
    tmp_path: Path, files: dict[str, bytes], fields: tuple[tuple[str, str], ...], said: str
) -> None:
    with pytest.raises(InvalidRequestError) as caught:
        read_files(bytes(form(files, *fields)), TYPE, tmp_path, BOUNDS)
    (fault,) = caught.value.faults
    assert f"{fault.pointer}: {fault.message}".startswith(said)


def test_a_form_becomes_a_report_and_a_map(tmp_path: Path) -> None:
    told, found = read_files(bytes(form({"a.csv": SQUARE}, ("point", "1 1"))), TYPE, tmp_path, BOUNDS)
    assert (told["report"]["format"], told["report"]["files"]) == ("csv", ("a.csv",))
    assert (found["segments"].shape, found["oriented"], found["meta"]) == ((4, 4), True, {"source": "a.csv"})
