"""Result of the bounded process for a form."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from linefix.documents.errors import InvalidRequestError
from service.importing.reader import Bounds, read_files, read_scans

from .forms import SQUARE, TYPE, YAML, form

BOUNDS = Bounds(1_000_000_000, 32_000_000, 200_000)
LOG = b"FLASER 3 1.0 2.0 3.0 0 0 0 0 0 0 100.0 robot 100.0\n"


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
    assert told["picture"] is None
    assert (told["report"]["format"], told["report"]["files"]) == ("csv", ("a.csv",))
    assert (found["segments"].shape, found["oriented"], found["meta"]) == ((4, 4), True, {"source": "a.csv"})


def test_more_segments_than_a_map_may_have(tmp_path: Path) -> None:
    (told,) = read_files(bytes(form({"a.csv": SQUARE})), TYPE, tmp_path, replace(BOUNDS, segments=3))
    assert told["too_large"].startswith("expected at most 3 segments, found 4")


@pytest.mark.parametrize(
    ("files", "fields", "said"),
    [
        ({"a.log": LOG, "b.log": LOG}, (), "/files: expected one log"),
        ({}, (), "/files: expected a file, found none"),
        ({"a.bag": b"no bag"}, (), "/files/0: "),
        ({"a.log": LOG}, (("max_scans", "0"),), "/max_scans: expected an integer from 1 to 1000"),
        ({"a.log": LOG}, (("units", "m"),), "/units: unknown field"),
        ({"a.log": LOG}, (("topic", "a"), ("topic", "b")), "/topic: expected this field once"),
    ],
    ids=["two", "none", "broken", "no scans", "a field of maps", "twice"],
)
def test_what_is_no_log_is_named(
    tmp_path: Path, files: dict[str, bytes], fields: tuple[tuple[str, str], ...], said: str
) -> None:
    with pytest.raises(InvalidRequestError) as caught:
        read_scans(bytes(form(files, *fields)), TYPE, tmp_path)
    (fault,) = caught.value.faults
    assert f"{fault.pointer}: {fault.message}".startswith(said)


def test_a_map_is_no_log(tmp_path: Path) -> None:
    (told,) = read_scans(bytes(form({"plan.dxf": b"0"})), TYPE, tmp_path)
    assert told["unknown"].startswith("found no log; expected a file that ends in one of .bag")
