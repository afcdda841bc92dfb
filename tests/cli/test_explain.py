"""linefix explain: as the documents show it, and number by number."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from .running import Linefix, refused

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


def named(model: Any) -> list[Any]:
    """Return the terms of a model that are features of the answer."""
    terms = [term for term in model["contributions"] if term["value"] is not None and term["name"] != "constant"]
    assert terms
    return terms


def explained(linefix: Linefix, *arguments: str) -> Any:
    ended = linefix("explain", *arguments, "--json")
    assert ended.code == 0, ended.err
    return json.loads(ended.out)


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


@pytest.mark.parametrize(("on", "usable"), [("room.json", True), ("rooms.json", False)])
def test_the_numbers_add_up(linefix: Linefix, on: str, usable: bool) -> None:
    """Terms to log odds, these to a probability, that times the one among alternatives to the one that is answered."""
    found = explained(linefix, on, "scan.json")
    verdict, answer = found["verdict"], found["answer"]
    assert (verdict["usable"], answer["usable"]) == (usable, usable)
    assert all(verdict["features"][term["name"]] == term["value"] for term in named(verdict["model"]))
    among, model = verdict["among_alternatives"], verdict["model"]
    mean = among.pop("mean")
    least = min(value for value in among.values() if value is not None)
    assert among["as_scored"] == pytest.approx(1.0 / (1.0 + sum(one["weight"] for one in verdict["alternatives"])))
    assert least <= mean <= max(among.values())
    assert model["log_odds"] == pytest.approx(sum(term["nats"] for term in model["contributions"]))
    assert verdict["probability_of_pose"] == pytest.approx(least * model["probability"])
    assert verdict["probability_of_pose"] == answer["probability"]
    assert (verdict["probability_of_pose"] >= verdict["thresholds"]["usable_from"]) is usable
    assert (verdict["null"] is None) is not usable


def test_a_veto_that_applies_is_shown(linefix: Linefix, folder: Path) -> None:
    corner = json.loads((folder / "scan.json").read_text())
    corner["segments"] = corner["segments"][:2]
    (folder / "corner.json").write_text(json.dumps(corner))
    verdict = explained(linefix, "room.json", "corner.json")["verdict"]
    (only,) = [veto for veto in verdict["vetoes"] if veto["applies"]]
    assert only == {
        "name": "few_walls",
        "origin": "measured",
        "applies": True,
        "reasons": ["insufficient_evidence", "single_wall"],
    }
    assert re.search(r"few_walls +measured +applies", linefix("explain", "room.json", "corner.json").out)


def test_without_an_answer_there_are_vetoes_only(linefix: Linefix, folder: Path) -> None:
    (folder / "nothing.json").write_text('{"segments": []}')
    found = explained(linefix, "room.json", "nothing.json")
    assert found["answer"]["status"] == found["verdict"]["status"] == "no_match"
    assert found["verdict"]["features"] is None
    printed = linefix("explain", "room.json", "nothing.json")
    assert printed.code == 0
    assert "status no_match, not usable" in printed.out


def test_it_takes_what_locate_takes(linefix: Linefix) -> None:
    """A window that the scan contradicts is a veto."""
    near = ("--near", "12", "1", "1.57", "--radius", "0.5")
    located = json.loads(linefix("locate", "room.json", "scan.json", *near, "--json").out)
    found = explained(linefix, "room.json", "scan.json", *near)
    assert {**found["answer"], "request_id": 0, "timing_ms": 0} == {**located, "request_id": 0, "timing_ms": 0}
    assert "better_elsewhere" in [veto["name"] for veto in found["verdict"]["vetoes"] if veto["applies"]]
    assert "--help" in refused(linefix("explain", "room.json"), 2)
    assert "nowhere.json" in refused(linefix("explain", "room.json", "nowhere.json"), 2)
