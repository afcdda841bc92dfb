"""--on-map and --usable-from, in each command that searches."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from association import AssociationOptions
from cli.options import UsableOptions
from tests.batch.logs import rows
from tests.batch.logs import write_log as write_table
from tests.map_quality.check.drawn import faces
from tests.running import RunningService

from .drives import write_log
from .running import Linefix

HALF, SURE = ("--on-map", "0.5"), ("--on-map", "1")


@pytest.fixture(autouse=True)
def _files(folder: Path) -> None:
    (folder / "floor.json").write_text(json.dumps({"segments": faces().tolist()}))
    write_log(folder / "drive.log", 1)
    write_table(folder / "scans.parquet", 1)


def located(linefix: Linefix, *options: str) -> Any:
    return linefix.done("locate", "room.json", "scan.json", "--json", *options).answer


def replayed(linefix: Linefix, *options: str) -> Any:
    return linefix.done("replay", "drive.log", "--map", "floor.json", "--json", *options).answer


def explained(linefix: Linefix, *options: str) -> Any:
    found = linefix.done("explain", "room.json", "scan.json", "--json", *options).answer
    assert found["answer"]["usable"] == found["verdict"]["usable"]
    return found["answer"]


def in_batch(linefix: Linefix, *options: str) -> Any:
    linefix.done("batch", "scans.parquet", "--maps", "room.json", "--out", "o.parquet", "--workers", "1", *options)
    (row,) = rows(Path("o.parquet"))
    return row


def between(linefix: Linefix, command: Any) -> float:
    """Return a probability between those with the least and the greatest prior."""
    half, sure = (command(linefix, *options)["probability"] for options in (HALF, SURE))
    assert half < sure
    return float(min(0.5 * (half + sure), 0.9999))


def test_the_defaults_are_those_of_the_search() -> None:
    search = AssociationOptions()
    assert UsableOptions() == UsableOptions(search.on_map, search.usable_from)


@pytest.mark.parametrize("command", [located, explained, replayed, in_batch])
def test_both_decide_what_is_usable(linefix: Linefix, command: Any) -> None:
    # A batch has the probabilities of `locate`: its scan is the same, and a run of it takes seconds.
    least = ("--usable-from", str(between(linefix, located if command is in_batch else command)))
    assert [command(linefix, *options, *least)["usable"] for options in (HALF, SURE)] == [False, True]


@pytest.mark.parametrize("command", [located, replayed])
def test_a_server_gets_them(linefix: Linefix, service: RunningService, command: Any) -> None:
    least = ("--usable-from", str(between(linefix, command)))
    for options in ((*HALF, *least), (*SURE, *least)):
        here, there = command(linefix, *options), command(linefix, *options, "--server", service.url)
        assert (here["usable"], here["probability"]) == (there["usable"], there["probability"])
        assert here["usable"] is (SURE[1] in options)
