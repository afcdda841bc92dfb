"""A log on the page: its timeline, its filter, and the plan that follows it."""

from __future__ import annotations

import json
from typing import Any

import pytest
from playwright.sync_api import FilePayload, Page, expect

from linefix.documents import examples

from .plan import Plan, box_of, shown, verdict

SIMILAR = [{"code": "similar_place", "message": "see `alternatives`"}]
FAR = 2.0  # m from scan to scan


def line(k: int, status: str, usable: bool, reasons: list[Any]) -> dict[str, Any]:
    pose = None if status == "no_match" else {"x": FAR * k, "y": 0.0, "theta": 0.0}
    return {"stamp": k, "status": status, "usable": usable, "probability": 0.9, "reasons": reasons, "pose": pose}


LINES = [
    line(0, "no_match", False, ["not_on_map"]),
    line(1, "ok", True, []),
    line(2, "ambiguous", False, SIMILAR),
    line(3, "no_match", False, ["not_on_map"]),
    line(4, "ambiguous", False, SIMILAR),
    line(5, "ok", True, []),
]
AT = """at => {
  const canvas = document.querySelector("#timeline canvas"), width = canvas.clientWidth, ratio = devicePixelRatio;
  const x = 6 + at * (width - 12) / 5;
  return [...canvas.getContext("2d").getImageData(Math.round(x * ratio), canvas.height - 3, 1, 1).data];
}"""


@pytest.fixture
def log(page: Page) -> Page:
    """The page with a map and a replay of six scans."""
    shown(page, "flat", "usable")
    text = "\n".join(map(json.dumps, LINES)).encode()
    room = json.dumps({"segments": examples.WALLS}).encode()
    payloads: list[FilePayload] = [
        {"name": "room.json", "mimeType": "", "buffer": room},
        {"name": "replay.jsonl", "mimeType": "", "buffer": text},
    ]
    page.set_input_files("#files", payloads)
    expect(page.locator("#origin")).to_have_text("6 verdicts of replay.jsonl")
    return page


def told(page: Page, text: str) -> None:
    expect(page.locator("#scan-of-log")).to_contain_text(text)


def test_a_log_is_played_and_the_verdict_follows(log: Page) -> None:
    told(log, "Scan 1 of 6: no match, not usable, 90.00 %: not on map. (2 of 6 are usable.)")
    verdict(log, "no_match")
    expect(log.locator("#reasons")).to_contain_text("The scan fits the map no better than an unrelated scan would.")
    for kind in ("usable", "ambiguous", "no match"):
        expect(log.locator("#legend").get_by_text(kind, exact=True)).to_be_visible()
    log.get_by_role("button", name="Play").click()
    expect(log.get_by_label("simulate the scan")).not_to_be_checked()
    told(log, "Scan 6 of 6: ok, usable")
    verdict(log, "usable")
    expect(log.get_by_role("button", name="Play")).to_be_enabled()


def test_the_map_still_fits_next_to_the_log(log: Page) -> None:
    """The map is opened before the log, which takes some of its height."""
    plan = Plan(log, (-4.0, -3.0, 4.0, 3.0))
    log.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    assert [plan.colour(-4.0, y)[3] > 0 for y in (-2.9, 0.0, 2.9)] == [True] * 3


def test_a_scan_without_a_pose_keeps_the_last_one(log: Page) -> None:
    log.get_by_label("Scan of the log").fill("3")
    told(log, "Scan 4 of 6: no match")
    expect(log.locator("#legend")).to_contain_text("last pose")
    log.get_by_label("Scan of the log").fill("4")
    expect(log.locator("#legend")).not_to_contain_text("last pose")


def test_the_timeline_has_the_colours_of_verdicts_and_a_filter_by_reason(log: Page) -> None:
    first = [log.evaluate(AT, k) for k in range(6)]
    assert first[0] == first[3] != first[1] == first[5] != first[2] == first[4]
    choices = log.locator("#filter option")
    expect(choices).to_have_text(
        ["all scans (6)", "usable (2)", "not usable (4)", "not on map (2)", "similar place (2)"]
    )
    log.get_by_label("Filter").select_option(label="similar place (2)")
    faded = [log.evaluate(AT, k) for k in range(6)]
    assert [before == after for before, after in zip(first, faded, strict=True)] == [k in (2, 4) for k in range(6)]
    slider = log.get_by_label("Scan of the log")
    slider.focus()
    for scan in (3, 5, 5):
        log.keyboard.press("ArrowRight")
        told(log, f"Scan {scan} of 6: ambiguous, not usable, 90.00 %: similar place.")
    expect(slider).to_have_attribute("aria-valuetext", "scan 5 of 6: ambiguous, not usable, 90.00 %")
    expect(log.locator("#reasons")).to_contain_text("Step through the alternatives.")
    log.keyboard.press("ArrowLeft")
    told(log, "Scan 3 of 6")


def test_the_robot_stays_on_the_plan(log: Page) -> None:
    """Zoomed in, the plan follows it to its pose, which is then in the middle."""
    for _ in range(6):
        log.get_by_role("button", name="Zoom in").click()
    log.get_by_label("Scan of the log").fill("5")
    told(log, "Scan 6 of 6")
    box = box_of(log, "#plan")
    log.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    expect(log.locator("#cursor")).to_have_text("x 10.00 m, y 0.00 m")
    log.mouse.move(box["x"] + box["width"] / 2, 10)
    expect(log.locator("#cursor")).to_be_empty()
