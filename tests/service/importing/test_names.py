"""Class of attack: path traversal, by names and references in what is uploaded.

Uploaded names, and names in uploaded files, open uploaded files only. No error contains a temporary path.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any
from urllib.parse import quote

import ezdxf
import pytest

from linefix.documents.errors import InvalidRequestError
from service.errors import ServiceError
from service.importing.reader import Bounds, read_files
from tests.formats.bags import GRID, Robots, room_cells

from .forms import SQUARE, TYPE, YAML, form, room_grid

BOUNDS = Bounds(1_000_000_000, 32_000_000, 200_000)


@pytest.fixture
def elsewhere(tmp_path: Path) -> Path:
    """Return a bag of SQLite that lies on this machine, and was not sent."""
    bag = Robots("sqlite3", tmp_path)
    bag.write("/map", GRID, 1, bag.messages.grid(room_cells()))
    (path,) = bag.done().glob("*.db3")
    return path


class Place:
    """Reads forms into a fresh folder each."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._count = 0

    def answer(self, files: dict[str, bytes], *fields: tuple[str, str]) -> list[Any]:
        """Return what the process that reads prints."""
        self._count += 1
        folder = self._folder / f"linefix-{self._count}"
        folder.mkdir()
        return read_files(bytes(form(files, *fields)), TYPE, folder, BOUNDS)

    def read(self, files: dict[str, bytes], *fields: tuple[str, str]) -> tuple[Any, Any]:
        """Return report and map of files that are read."""
        told, found = self.answer(files, *fields)
        return told["report"], found

    def refused(self, files: dict[str, bytes]) -> str:
        """Return the error of files that are not read; it contains no temporary path."""
        with pytest.raises((InvalidRequestError, ServiceError)) as caught:
            self.answer(files)
        error = caught.value
        faults = error.faults if isinstance(error, InvalidRequestError) else ()
        said = str([(one.pointer, one.message) for one in faults]) + str(error)
        assert "linefix-" not in said
        assert str(self._folder) not in said
        return said


@pytest.fixture
def place(tmp_path: Path) -> Place:
    (tmp_path / "temporary").mkdir()
    return Place(tmp_path / "temporary")


def ways_to(target: Path, depth: int) -> list[str]:
    """Return names that are, undone or cut off as URIs are, the path of a file elsewhere."""
    up = "../" * depth + str(target).lstrip("/")
    whole = quote(up, safe="").replace(".", "%2e")
    return [
        f"{whole}%3f.db3",
        f"{whole}?.db3",
        f"{whole}#.db3",
        f"{whole}%00.db3",
        f"{quote(str(target), safe='')}#.db3",
        f"x.db3%2f{whole}?mode=ro&x=.db3",
        f"%2fproc%2fself%2froot{quote(str(target), safe='')}?.db3",
        f"{whole}.db3",
    ]


@pytest.mark.parametrize("way", range(8))
def test_the_name_of_a_database_opens_no_other(elsewhere: Path, place: Place, way: int) -> None:
    """Neither is a database read that is there, nor is it told from one that is not."""
    there, none = (ways_to(path, 12)[way] for path in (elsewhere, elsewhere.with_name("none.db3")))
    assert place.refused({there: b"no database"}) == place.refused({none: b"no database"})


@pytest.mark.parametrize("name", ["a?b.db3", "a#b.db3", "100%.db3", "a%20b.db3", "file:a.db3", "..%2f.db3", "-.db3"])
def test_an_odd_name_is_no_hindrance(elsewhere: Path, place: Place, name: str) -> None:
    report, found = place.read({name: elsewhere.read_bytes()})
    assert (report["format"], report["files"], found["meta"]["source"]) == ("rosbag2", (name,), name)


def test_a_bag_of_several_files_is_read(elsewhere: Path, place: Place) -> None:
    report, found = place.read({path.name: path.read_bytes() for path in elsewhere.parent.iterdir()})
    assert report["format"] == "rosbag2"
    assert "linefix-" not in f"{report} {found['meta']}"


@pytest.mark.parametrize("way", range(8))
def test_the_metadata_of_a_bag_opens_no_other(elsewhere: Path, place: Place, way: int) -> None:
    metadata = (elsewhere.parent / "metadata.yaml").read_text()
    said = []
    for target in (elsewhere, elsewhere.with_name("none.db3")):
        name = ways_to(target, 12)[way]
        told = metadata.replace(elsewhere.name, name).encode()
        place.refused({"metadata.yaml": told})
        said.append(place.refused({"metadata.yaml": told, name: b"no database"}))
    assert said[0] == said[1]
    for reference in (str(elsewhere), f"../{elsewhere.name}", f"../../../{elsewhere}"):
        place.refused({"metadata.yaml": metadata.replace(elsewhere.name, reference).encode()})


@pytest.mark.parametrize("kind", ["bag", "mcap", "db3"])
def test_no_error_tells_where_files_are_put(place: Place, kind: str) -> None:
    for content in (b"", b"SQLite format 3\0" + bytes(84), b"#ROSBAG V2.0\n", b"\x89MCAP0\r\n" + bytes(40)):
        place.refused({f"a.{kind}": content})


@pytest.mark.parametrize(
    "image", ["{0}", "../../../../../..{0}", "..\\..\\{0}", "file://{0}", "{0}%00.pgm", "/dev/zero"]
)
def test_a_description_opens_no_picture_that_was_not_sent(place: Place, tmp_path: Path, image: str) -> None:
    picture = tmp_path / "room.pgm"
    picture.write_bytes(room_grid()["room.pgm"])
    said = place.refused({"a.yaml": YAML % image.format(picture).encode()})
    assert "was not sent" in said or "expected image" in said


@pytest.mark.parametrize("name", ["plan ä (1).pgm", "a%2e%2e.pgm", "x?y.pgm", "file-0.yaml.pgm", "file-0.pgm"])
def test_a_picture_is_found_by_the_name_in_its_description(place: Place, name: str) -> None:
    """Whatever it is called; the name is not that of a file."""
    report, found = place.read({"a.yaml": YAML % f'"{name}"'.encode(), name: room_grid()["room.pgm"]})
    assert (report["files"], found["meta"]["source"]) == (("a.yaml", name), "a.yaml")


def test_drawings_open_nothing(place: Place, tmp_path: Path) -> None:
    secret = tmp_path / "secret.svg"
    secret.write_bytes(b'<svg xmlns="http://www.w3.org/2000/svg"><line id="a" x1="0" y1="0" x2="77" y2="0"/></svg>')
    line = '<line x1="0" y1="0" x2="9" y2="0"/>'
    svg = (
        '<?xml version="1.0"?>{0}<svg xmlns="http://www.w3.org/2000/svg" '
        'xmlns:xlink="http://www.w3.org/1999/xlink">{1}</svg>'
    )
    drawn = f'<image href="file://{secret}"/><use xlink:href="file://{secret}#a"/><a href="{secret}">{line}</a>'
    metres = ("units", "1")
    for declared, content in (("", drawn), (f'<!DOCTYPE svg SYSTEM "file://{secret}">', line)):
        _, found = place.read({"a.svg": svg.format(declared, content).encode()}, metres)
        assert found["segments"].max() == 9.0
    for declared in (
        f'<!DOCTYPE svg [<!ENTITY x SYSTEM "file://{secret}">]>',
        f'<!DOCTYPE svg [<!ENTITY % x SYSTEM "file://{secret}"> %x;]>',
    ):
        assert "entities" in place.refused({"a.svg": svg.format(declared, f"<text>&x;</text>{line}").encode()})


def test_a_drawing_in_another_file_is_not_opened(place: Place, tmp_path: Path) -> None:
    other, own = ezdxf.new(), ezdxf.new(units=6)
    other.modelspace().add_line((0, 0), (77, 0))
    other.saveas(tmp_path / "other.dxf")
    own.modelspace().add_line((0, 0), (7, 0))
    own.add_xref_def(str(tmp_path / "other.dxf"), "other")
    own.modelspace().add_blockref("other", (0, 0))
    own.saveas(tmp_path / "own.dxf")
    _, found = place.read({"a.dxf": (tmp_path / "own.dxf").read_bytes()})
    assert found["segments"].max() == 7.0


@pytest.mark.parametrize("name", ["a.zip", "a.tar.gz", "a.csv.gz", "a.csv/../../b", "a.csv\\..\\..\\b", ".csv"])
def test_archives_and_names_without_an_ending_are_no_maps(place: Place, name: str) -> None:
    place.refused({name: SQUARE})
