"""Commands that are wrong: one line that names the file, option or argument, and the exit code."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.batch.logs import ROOM, SEEN
from tests.batch.logs import write_log as write_table
from tests.map_quality.check.drawn import faces
from tests.service.importing.forms import SQUARE

from .drives import write_log
from .running import Linefix, refused

NOBODY = "--server http://127.0.0.1:9"
ON_ROOM, ON_FLOOR, TO_FILE = "--maps room.json", "--map floor.json", "--out o.parquet"
# A command, its exit code, and a part of its line.
REFUSED: dict[str, tuple[int, str]] = {
    "lokate": (2, "lokate"),
    "locate room.json": (2, "expected linefix locate [OPTIONS] MAP... SCAN; linefix locate --help"),
    "locate nowhere.json scan.json": (2, "nowhere.json"),
    "locate hall scan.json": (3, "hall: no such file, and no map is stored"),
    "locate empty scan.json": (2, "no map file"),
    "locate room.json broken.json": (3, "broken.json: not JSON"),
    "locate room.json bad.json": (3, "linefix: bad.json: /segments/0: expected 4 numbers"),
    "locate room.json bad.json scan.json": (3, "linefix: bad.json: /segments/0: expected 4 numbers"),
    "locate room.json utf-16.json": (3, "utf-16.json: is not YAML"),
    "locate room.json drive.log": (2, "expected one scan; linefix replay LOG --map MAP"),
    "locate room.json empty": (2, "expected one scan; linefix replay LOG --map MAP"),
    "locate room.json scan.json --server localhost": (2, "--server"),
    f"locate room.json scan.json {NOBODY}": (4, "linefix serve"),
    "locate room.json scan.json --deadline-ms -5": (3, "linefix: --deadline-ms: expected"),
    "locate room.json scan.json --on-map 0.4": (2, "--on-map"),
    "locate room.json floor.json scan.json --near 1 0.5 1.57": (2, "--near: found several maps"),
    "register room.json scan.json --correspondences pairs.json": (3, "linefix: pairs.json: /0"),
    "vectorize points.json": (3, "linefix: points.json: /points/0: expected"),
    "explain room.json": (2, "--help"),
    "explain room.json nowhere.json": (2, "nowhere.json"),
    "explain room.json scan.json --on-map 1.1": (2, "--on-map"),
    "ros2 --map room.json --on-map 0": (2, "--on-map"),
    "analyze room.json --fov 360": (3, "--fov: expected radians"),
    "analyze room.json --point 100 0": (3, "--point: expected a place"),
    "analyze room.json --drive 31": (3, "--drive: expected at most 30"),
    "analyze room.json --deadline-ms nan": (3, "--deadline-ms: expected"),
    "analyze room.json --landmark none.json": (2, "none.json"),
    f"batch a.parquet {ON_ROOM}": (2, "--out"),
    f"batch gone.parquet {ON_ROOM} {TO_FILE}": (3, "gone.parquet"),
    f"batch a.parquet --maps nowhere {TO_FILE}": (3, "nowhere: holds no map"),
    f"batch room.json {ON_ROOM} {TO_FILE} --ray --workers 2": (2, "--workers"),
    f"batch a.parquet {ON_ROOM} --out .": (2, "found the folder"),
    f"batch a.parquet {ON_ROOM} {TO_FILE} --usable-from 0.4": (2, "--usable-from"),
    f"replay nowhere.log {ON_FLOOR}": (2, "nowhere.log: there is no such file"),
    f"replay empty.log {ON_FLOOR}": (3, "empty.log: has no scan"),
    f"replay drive.txt {ON_FLOOR}": (3, "ends in one of .bag"),
    f"replay drive.log {ON_FLOOR} --topic FLASER": (3, "no FLASER; it has 1 ROBOTLASER1"),
    f"replay drive.log {ON_FLOOR} --mode both": (2, "--mode"),
    f"replay drive.log {ON_FLOOR} --mount 0 nan 0": (2, "--mount: expected"),
    f"replay drive.log {ON_FLOOR} --mount 0 0 90": (2, "--mount: expected"),
    f"replay drive.log {ON_FLOOR} --usable-from 1": (2, "--usable-from"),
    "replay drive.log --map hall": (3, "hall: no such file, and no map is stored"),
    "replay drive.log --map short.json": (3, "short.json: /segments/0: is shorter"),
    "replay drive.log": (2, "--map"),
    "map check bad.json": (3, "linefix: bad.json: /segments/0: expected 4 numbers"),
    "map check room.json --scan scan.json --scan bad.json": (3, "linefix: bad.json: /segments/0"),
    f"map check floor.json {NOBODY}": (2, f"map put ID FILE {NOBODY},"),
    "map put bad bad.json": (3, "linefix: bad.json: /segments/0: expected 4 numbers"),
    "map put a/b floor.json": (2, "the id is not valid"),
    "map import nowhere.yaml": (2, "nowhere.yaml: there is no such file"),
    "map import broken.svg --units m": (3, "broken.svg: is not XML"),
    "map import plan.svg": (3, "linefix: plan.svg: does not state its unit"),
    "map import plan.csv --units parsec": (3, "linefix: --units: expected one of mm"),
    "map import plan.csv --point 99 99": (3, "--point: lies on a line or outside"),
    "map import plan.csv --out plan.dwg": (3, "plan.dwg: expected a name"),
    "map update floor.json": (2, "Missing argument"),
    "map update floor.json nowhere.log": (2, "nowhere.log: there is no such file"),
    "map update floor.json drive.log drive.log": (2, "found the same log twice"),
    "map update floor.json drive.log --accept 3": (2, "--accept"),
}


@pytest.fixture(autouse=True)
def _files(folder: Path) -> None:
    documents = {"room.json": {"segments": ROOM}, "scan.json": {"segments": SEEN}, "pairs.json": [[0, -1]]}
    documents |= {"bad.json": {"segments": [[1, 2, 3]]}, "points.json": {"points": [[1, 2, 3]]}}
    documents |= {"short.json": {"segments": [[0, 0, 0, 0]]}, "floor.json": {"segments": faces().tolist()}}
    texts = {name: json.dumps(one) for name, one in documents.items()}
    texts |= {"broken.json": '{"segments": 3', "broken.svg": "<svg", "empty.log": "# nothing\n", "drive.txt": ""}
    texts["plan.svg"] = '<svg xmlns="http://www.w3.org/2000/svg"><rect width="4" height="3"/></svg>'
    for name, text in texts.items():
        (folder / name).write_text(text)
    (folder / "utf-16.json").write_text(texts["scan.json"], encoding="utf-16")
    (folder / "plan.csv").write_bytes(SQUARE)
    (folder / "empty").mkdir()
    write_log(folder / "drive.log", 1)
    write_table(folder / "a.parquet", 1)


@pytest.mark.parametrize("command", REFUSED)
def test_what_is_wrong_is_named_in_one_line(linefix: Linefix, command: str) -> None:
    code, said = REFUSED[command]
    assert said in refused(linefix(*command.split()), code)
