"""linefix explain: as the documents show it, and number by number."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from .running import Linefix

DOCUMENT = Path(__file__).parents[2] / "docs" / "explanation" / "verdict.md"
FILES = re.compile(r"^`(\w+\.json)`.*?\n\n```json\n(.*?)```", re.MULTILINE | re.DOTALL)
SHOWN = re.compile(r"^```\n\$ linefix (explain .*?)\n(.*?)```", re.MULTILINE | re.DOTALL)


@pytest.fixture(autouse=True)
def _files(folder: Path) -> None:
    """Write the files that the document shows."""
    files = dict(FILES.findall(DOCUMENT.read_text()))
    assert set(files) == {"room.json", "rooms.json", "scan.json"}
    for name, text in files.items():
        (folder / name).write_text(text)


def explained(linefix: Linefix, *arguments: str) -> Any:
    return linefix.done("explain", *arguments, "--json").answer


@pytest.mark.parametrize("command", [command for command, _ in SHOWN.findall(DOCUMENT.read_text())])
def test_the_document_shows_what_is_printed(linefix: Linefix, command: str) -> None:
    """Line by line and in order; dots stand for lines that are left out, and spaces at the ends do not count."""
    shown = dict(SHOWN.findall(DOCUMENT.read_text()))[command].splitlines()
    printed = [line.rstrip() for line in linefix(*command.split()).out.splitlines()]
    at, skips = 0, False
    for line in shown:
        if line == "...":
            skips = True
            continue
        there = printed.index(line, at)
        assert skips or there == at, f"{printed[at]!r} is left out without dots"
        at, skips = there + 1, False


@pytest.mark.parametrize(("on", "others"), [("room.json", 0), ("rooms.json", 1)])
def test_the_numbers_add_up(linefix: Linefix, on: str, others: int) -> None:
    """Weights to the probability among alternatives, that times the one by the model to the one that is answered."""
    found = explained(linefix, on, "scan.json")
    verdict, answer = found["verdict"], found["answer"]
    assert found["last_view"] is None
    assert all(verdict["features"][term["name"]] == term["value"] for term in verdict["contributions"])
    assert set(verdict["log_odds"]) == {"wrong", "elsewhere"}
    assert len(verdict["alternatives"]) == others
    assert verdict["among"] == pytest.approx(1.0 / (1.0 + sum(one["weight"] for one in verdict["alternatives"])))
    assert answer["probability"] == verdict["probability"] == pytest.approx(verdict["by_model"] * verdict["among"])
    usable = answer["probability"] >= verdict["thresholds"]["usable_from"]
    assert (verdict["usable"], answer["usable"]) == (usable, usable)


def test_a_veto_that_applies_is_shown(linefix: Linefix, folder: Path) -> None:
    corner = json.loads((folder / "scan.json").read_text())
    corner["segments"] = corner["segments"][:1]
    (folder / "wall.json").write_text(json.dumps(corner))
    verdict = explained(linefix, "room.json", "wall.json")["verdict"]
    (only,) = [veto for veto in verdict["vetoes"] if veto["applies"]]
    assert only == {"name": "unobservable_direction", "applies": True, "reason": "unobservable_direction"}
    shown = r"unobservable_direction +true +unobservable_direction"
    assert re.search(shown, linefix("explain", "room.json", "wall.json").out)


def test_without_an_answer_there_are_vetoes_only(linefix: Linefix, folder: Path) -> None:
    (folder / "nothing.json").write_text('{"segments": []}')
    found = explained(linefix, "room.json", "nothing.json")
    assert found["answer"]["status"] == found["verdict"]["status"] == "no_match"
    assert found["verdict"]["features"] is None
    assert "verdict  no_match, not usable" in linefix.done("explain", "room.json", "nothing.json").out


def test_it_takes_what_locate_takes(linefix: Linefix) -> None:
    """A window that the scan contradicts is a veto."""
    near = ("--near", "12", "1", "1.57", "--radius", "0.5")
    located = linefix.done("locate", "room.json", "scan.json", *near, "--json").answer
    found = explained(linefix, "room.json", "scan.json", *near)
    assert {**found["answer"], "request_id": 0, "timing_ms": 0} == {**located, "request_id": 0, "timing_ms": 0}
    assert "better_elsewhere" in [veto["name"] for veto in found["verdict"]["vetoes"] if veto["applies"]]
