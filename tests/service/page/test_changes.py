"""Proposed changes of a map on the page."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from playwright.sync_api import FilePayload, Page, expect

from registration import RigidTransform, Segments
from simulation import scan
from tests.cli.drives import carmen, numbers
from tests.map_quality.update.hall import PILLAR, PLACES, RACK, SCANNER, box, segments

from .plan import Plan, shown

CRATE = box(9.1, 4.4, 9.5, 4.8)
OLD, TODAY = segments(RACK, PILLAR), segments(RACK, CRATE)
DAYS = ("monday", "tuesday", "wednesday")
BOUNDS = (0.0, 0.0, 13.0, 9.0)
REMOVED, ADDED = [0xD5, 0x5E, 0x00], [0x00, 0x9E, 0x73]
PILLAR_SIDE, CRATE_SIDE = (8.6, 3.3), (9.1, 4.6)  # m; on one wall of each


def ranges_of(walls: Segments, seed: int) -> list[tuple[RigidTransform, list[float]]]:
    rng, out = np.random.default_rng(seed), []
    for x, y in PLACES:
        at = RigidTransform(x, y, rng.uniform(-math.pi, math.pi))
        out.append((at, np.nan_to_num(scan(walls, at, SCANNER, rng).ranges, posinf=99.0).round(4).tolist()))
    return out


def visit(name: str, seed: int) -> dict[str, Any]:
    laser = {"angle_min": SCANNER.angle_min, "angle_increment": SCANNER.angle_increment, "range_max": 20.0}
    return {"visit": name, "scans": [{"laser": {**laser, "ranges": one}} for _, one in ranges_of(TODAY, seed)]}


def log(seed: int) -> bytes:
    """Return a visit as a CARMEN log."""
    scans = enumerate(ranges_of(TODAY, seed))
    return "".join(carmen(100 + k, ranges, SCANNER, numbers(at), numbers(at)) for k, (at, ranges) in scans).encode()


def payload(name: str, content: Any) -> FilePayload:
    body = content if isinstance(content, bytes) else json.dumps(content).encode()
    return {"name": name, "mimeType": "application/octet-stream", "buffer": body}


@pytest.fixture
def proposal(client: httpx.Client) -> Iterator[dict[str, Any]]:
    """The proposal for a stored hall: the pillar is gone, and a crate is new."""
    document = {"segments": OLD.endpoints.tolist(), "sigma": 0.005}
    client.put("/v1/maps/page-hall", json=document).raise_for_status()
    visits = [visit(day, k) for k, day in enumerate(DAYS)]
    answer = client.post("/v1/maps/page-hall:update", json={"visits": visits})
    found = answer.raise_for_status().json()
    assert [one["code"] for one in found["changes"]] in (["removed", "added"], ["added", "removed"])
    yield found
    client.delete("/v1/maps/page-hall")


def row(page: Page, code: str) -> Any:
    return page.locator("#change-list li", has_text=code)


def drawn(page: Page) -> Plan:
    """Return the plan once it is drawn."""
    page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return Plan(page, BOUNDS)


def test_changes_have_colours_evidence_and_a_map_with_the_accepted_ones(
    page: Page, client: httpx.Client, proposal: dict[str, Any], tmp_path: Path
) -> None:
    page.goto("/")
    page.locator("#files").set_input_files(payload("proposal.json", proposal))
    expect(page.locator("#proposed")).to_contain_text("2 of 2 changes accepted.")
    expect(page.locator("#about")).to_have_text("The stored map page-hall, and proposed changes.")
    expect(page.locator("#legend")).to_contain_text("removed")
    near = [drawn(page).colour(CRATE_SIDE[0], CRATE_SIDE[1] + 0.02 * k)[:3] for k in range(-5, 6)]
    assert ADDED in near
    near = [drawn(page).colour(PILLAR_SIDE[0], PILLAR_SIDE[1] + 0.02 * k)[:3] for k in range(-10, 11)]
    assert REMOVED in near  # dashed
    middle = [drawn(page).colour(8.3 + 0.02 * k, 3.3)[:3] for k in range(-5, 6)]
    assert REMOVED in middle  # its number

    told = next(one for one in proposal["changes"] if one["code"] == "removed")["evidence"]
    evidence = "{beams_through} beams pass through the old walls; from {poses} places on {visits} visits".format(**told)
    expect(row(page, "added")).to_contain_text(re.compile(r"added near \(9\.3, 4\.6\): 1\.\d\d m after"))
    page.mouse.move(*drawn(page).at(*PILLAR_SIDE))
    expect(page.locator("#hover")).to_contain_text(evidence)
    page.mouse.move(*drawn(page).at(6.0, 6.0))
    expect(page.locator("#hover")).to_be_hidden()
    row(page, "removed").locator("input").focus()
    expect(page.locator("#evidence")).to_contain_text(evidence)
    page.keyboard.press("Space")
    expect(page.locator("#proposed")).to_contain_text("1 of 2 changes accepted.")
    expect(page.locator("#legend")).to_contain_text("refused change")

    with page.expect_download() as begun:
        page.get_by_role("button", name="Download the map").click()
    begun.value.save_as(tmp_path / "new.json")
    flags = [{**one, "accepted": one["code"] == "added"} for one in proposal["changes"]]
    body = {"map": client.get("/v1/maps/page-hall").json(), "changes": flags}
    wanted = client.post("/v1/maps:apply", json=body).json()["map"]
    assert json.loads((tmp_path / "new.json").read_text()) == wanted
    assert wanted["segments"][: len(OLD)] == OLD.endpoints.tolist()
    assert len(wanted["segments"]) > len(OLD)

    page.get_by_role("button", name="Store as page-hall").click()
    expect(page.locator("#proposed")).to_contain_text("page-hall is stored with the accepted changes, revision 2.")
    assert client.get("/v1/maps/page-hall").json()["segments"] == wanted["segments"]
    expect(page.locator("#with-proposal")).to_be_hidden()


def test_a_click_on_the_plan_refuses_a_change_and_a_map_that_has_changed_is_kept(
    page: Page, client: httpx.Client, proposal: dict[str, Any]
) -> None:
    page.goto("/")
    page.locator("#files").set_input_files(payload("proposal.json", proposal))
    expect(row(page, "added").locator("input")).to_be_checked()
    page.mouse.click(*drawn(page).at(*CRATE_SIDE))
    expect(row(page, "added").locator("input")).not_to_be_checked()
    page.get_by_role("button", name="Refuse all").click()
    expect(page.locator("#proposed")).to_contain_text("0 of 2 changes accepted.")
    page.get_by_role("button", name="Accept all").click()
    changed = {"segments": [*OLD.endpoints.tolist(), [1.0, 1.0, 1.5, 1.0]]}
    client.put("/v1/maps/page-hall", json=changed).raise_for_status()
    page.get_by_role("button", name="Store as page-hall").click()
    expect(page.locator("#proposed")).to_contain_text("revision")
    assert client.get("/v1/maps/page-hall").json()["segments"] == changed["segments"]


def test_a_proposal_of_a_file_needs_its_map(page: Page, proposal: dict[str, Any]) -> None:
    """It may be opened together with it; on another map its indices name other walls."""
    shown(page, "flat", "usable")
    alone = payload("proposal.json", {**proposal, "based_on": None})
    page.locator("#files").set_input_files(alone)
    expect(page.locator("#reading")).to_contain_text("The changes in proposal.json are of another map")
    expect(page.locator("#with-proposal")).to_be_hidden()
    page.locator("#files").set_input_files([alone, payload("hall.json", {"segments": OLD.endpoints.tolist()})])
    expect(page.locator("#proposed")).to_contain_text("2 of 2 changes accepted.")
    expect(page.locator("#store-changes")).to_be_hidden()


def test_changes_of_a_stored_map_are_proposed_from_logs(page: Page, proposal: dict[str, Any]) -> None:
    page.goto("/")
    page.locator("#changes summary").click()
    page.locator("#visits").set_input_files([payload(f"{day}.log", log(k)) for k, day in enumerate(DAYS)])
    page.get_by_role("button", name="Propose changes").click()
    expect(page.locator("#proposed")).to_contain_text("Store it under")
    page.locator("#stored summary").click()
    page.get_by_role("button", name="Open page-hall").click()
    expect(page.locator("#about")).to_have_text("The stored map page-hall.")
    page.get_by_role("button", name="Propose changes").click()
    expect(page.locator("#proposed")).to_contain_text("2 of 2 changes accepted.", timeout=60_000)
    row(page, "added").hover()
    expect(page.locator("#evidence")).to_contain_text(" to wednesday.log")
