"""The page in a real browser, as a user has it."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import httpx
import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page, Route, expect

from linefix.documents import examples
from tests.issuing import ADMIN
from tests.running import RunningService

from .plan import ROOMS, Plan, box_of, shown, verdict

SCAN = {"segments": examples.SEEN, "sigma": 0.02}
PROBLEM = {"title": "t", "status": 503, "detail": "All places are taken", "code": "overloaded"}


def press(page: Page, key: str, times: int) -> None:
    for _ in range(times):
        page.keyboard.press(key)


@pytest.mark.parametrize(
    ("title", "state", "said"),
    [
        ("A flat", "usable", "The robot is at this pose"),
        ("An office", "usable", "The robot is at this pose"),
        ("Three equal rooms", "ambiguous", "2 other poses fit the scan about as well"),
        ("A corridor", "degenerate", "is unknown"),
        ("A warehouse", "usable", "The robot is at this pose"),
    ],
)
def test_every_example(page: Page, title: str, state: str, said: str) -> None:
    page.goto("/")
    page.get_by_label("Example").select_option(label=title)
    verdict(page, state)
    expect(page.locator("#message")).to_contain_text(said)
    expect(page.locator("#numbers")).to_contain_text("correspondences")
    expect(page.locator("#verdict")).not_to_contain_text("`")


def test_the_keyboard_alone(page: Page) -> None:
    """From the top of the page to a robot that is driven out of the room, where it knows again."""
    shown(page, "rooms", "ambiguous")
    for _ in range(20):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.id") == "plan":
            break
    assert page.evaluate("document.activeElement.id") == "plan"
    press(page, "n", 1)
    expect(page.locator("#other")).to_contain_text("Alternative 1 of 2")
    press(page, "Shift+ArrowLeft", 2)
    press(page, "Shift+ArrowDown", 3)
    press(page, "q", 3)
    verdict(page, "usable")
    press(page, "Shift+ArrowUp", 3)
    verdict(page, "ambiguous")


def test_a_robot_is_dragged(page: Page) -> None:
    shown(page, "rooms", "ambiguous")
    plan = Plan(page, ROOMS)
    page.mouse.move(*plan.at(6.75, 4.2))
    page.mouse.down()
    page.mouse.move(*plan.at(4.0, 1.0), steps=4)
    expect(page.locator("#cursor")).to_have_text("x 4.00 m, y 1.00 m")
    page.mouse.up()
    verdict(page, "usable")
    expect(page.locator("#numbers")).to_contain_text("4.0")


def test_noise_and_walls_that_are_missing(page: Page) -> None:
    shown(page, "flat", "usable")
    chance = page.locator("#numbers dd").first
    before = chance.inner_text()
    assert before.endswith(" %")
    page.get_by_label("Noise").fill("0.2")
    expect(page.locator("#noise-value")).to_have_text("20.0 cm")
    expect(chance).not_to_have_text(before)
    page.get_by_label("Noise").fill("0")
    verdict(page, "usable")
    expect(page.get_by_role("button", name="Restore the map")).to_be_disabled()
    page.get_by_label("remove walls").check()
    box = box_of(page, "#plan")
    for share in (0.2, 0.35, 0.5, 0.65, 0.8):
        for other in range(12):
            page.mouse.click(box["x"] + (0.1 + 0.066 * other) * box["width"], box["y"] + share * box["height"])
    expect(page.get_by_role("button", name="Restore the map")).to_be_enabled()
    page.get_by_role("button", name="Restore the map").click()
    verdict(page, "usable")
    expect(chance).to_have_text(before)


def files(folder: Path, **contents: object) -> list[Path]:
    for name, content in contents.items():
        (folder / f"{name}.json").write_text(json.dumps(content))
    return [folder / f"{name}.json" for name in contents]


def test_files_of_a_user(page: Page, tmp_path: Path) -> None:
    page.goto("/")
    room, scan = files(tmp_path, room={"segments": examples.WALLS}, scan=SCAN)
    page.set_input_files("#files", [scan])
    expect(page.locator("#about")).to_contain_text("Now open its map")
    expect(page.get_by_label("Example")).to_have_value("")
    page.set_input_files("#files", [room])
    verdict(page, "usable")
    expect(page.locator("#numbers")).to_contain_text("1.000 m, 0.500 m")
    (bad,) = files(tmp_path, bad={"rooms": 3})
    page.set_input_files("#files", [bad])
    expect(page.locator("#reading")).to_contain_text("neither a map nor a scan")
    (short,) = files(tmp_path, short={"laser": {"angle_min": 0, "angle_increment": 9, "ranges": [1, 2]}})
    page.set_input_files("#files", [short])
    expect(page.locator("#message")).to_contain_text("/scan/laser/angle_increment")


def test_a_service_without_the_formats(page: Page, tmp_path: Path) -> None:
    detail = "the service cannot read files of other tools: it lacks the extra `formats`"
    problem = {**PROBLEM, "status": 415, "detail": detail, "code": "unsupported_media_type"}
    page.route("**/v1/maps:import", lambda route: route.fulfill(status=415, json=problem))
    page.goto("/")
    (tmp_path / "plan.dxf").write_text("0")
    page.set_input_files("#files", [tmp_path / "plan.dxf"])
    expect(page.locator("#reading")).to_have_text(detail.replace("`", ""))
    expect(page.locator("#reading code")).to_have_text("formats")


NO_ROLE = "the key lacks the role `associate`; send a key that has it"
REFUSALS: list[tuple[dict[str, object] | None, str | re.Pattern[str]]] = [
    (PROBLEM, "The service is busy. Try again in some seconds."),
    (
        {**PROBLEM, "status": 403, "detail": NO_ROLE, "code": "forbidden"},
        f"{NO_ROLE} (see Key below).".replace("`", ""),
    ),
    (None, re.compile("does not respond")),
]


def test_refusals_and_a_lost_connection(page: Page) -> None:
    shown(page, "flat", "usable")
    current = REFUSALS[:1]

    def answer(route: Route) -> None:
        ((problem, _),) = current
        route.abort() if problem is None else route.fulfill(status=int(str(problem["status"])), json=problem)

    page.route("**/v1/associate", answer)
    for problem, said in REFUSALS:
        current[:] = [(problem, said)]
        page.get_by_role("button", name="Search").click()
        expect(page.locator("#message")).to_have_text(said)
        verdict(page, "problem")
    page.unroute("**/v1/associate")
    page.get_by_role("button", name="Search").click()
    verdict(page, "usable")


def test_a_service_with_keys(page: Page, guarded: RunningService) -> None:
    page.goto(f"{guarded.url}/?example=flat")
    verdict(page, "problem")
    expect(page.locator("#message")).to_contain_text("Key")
    page.locator("#access summary").click()
    page.locator("#key").fill(ADMIN)
    page.get_by_role("button", name="Search").click()
    verdict(page, "usable")


def test_where_a_map_will_fail(page: Page) -> None:
    shown(page, "rooms", "ambiguous")
    page.locator("#analysis summary").click()
    page.get_by_label("Spacing").fill("1")
    page.get_by_role("button", name="Analyze").click()
    expect(page.locator("#analyzed")).to_contain_text("Localization succeeds at", timeout=60_000)
    expect(page.locator("#legend")).to_contain_text("ambiguous")
    page.mouse.move(*Plan(page, ROOMS).at(9.3, 4.3))  # the upper part of the right room
    expect(page.locator("#hover")).to_contain_text("similar place at (")
    told, box = box_of(page, "#hover"), box_of(page, "#plan")
    assert told["x"] + told["width"] < box["x"] + box["width"]
    page.get_by_role("button", name="Clear").click()
    expect(page.locator("#analyzed")).to_be_empty()
    page.get_by_label("Spacing").fill("0.01")
    page.get_by_role("button", name="Analyze").click()
    expect(page.locator("#analyzed")).to_contain_text("/spacing")


def test_what_a_drive_and_a_box_would_do(page: Page, client: httpx.Client) -> None:
    """In a rectangle the robot can be at either of two places; a box tells them apart."""
    rectangle = {"segments": [[0, 0, 8, 0], [8, 0, 8, 5], [8, 5, 0, 5], [0, 5, 0, 0]]}
    client.put("/v1/maps/page-rectangle", json=rectangle).raise_for_status()
    page.goto("/")
    page.locator("#stored summary").click()
    page.get_by_role("button", name="Open page-rectangle").click()
    expect(page.locator("#about")).to_have_text("The stored map page-rectangle.")
    page.get_by_label("simulate the scan").check()
    verdict(page, "ambiguous")
    page.get_by_label("add a box").check()
    plan = Plan(page, (0.0, 0.0, 8.0, 5.0))
    page.mouse.click(*plan.at(6.0, 3.5))
    verdict(page, "usable")
    page.mouse.move(*plan.at(6.5, 3.5))
    expect(page.locator("#hover")).to_have_text("wall 6, added")  # 4 are the map's
    page.locator("#analysis summary").click()
    page.get_by_label("Spacing").fill("2")
    page.get_by_label("Drive up to").fill("2")
    page.get_by_role("button", name="Analyze").click()
    told = page.locator("#analyzed")
    expect(told).to_contain_text("Localization succeeds at 0 of 8 places", timeout=60_000)
    expect(told).to_contain_text("After a drive of up to 2 m: at 0. With the added boxes: at")
    assert "2 m: at 0." in told.inner_text()
    assert not told.inner_text().endswith("boxes: at 0.")
    show = page.get_by_label("Show")
    expect(show).to_have_value("landmark")
    show.select_option("driven")
    page.get_by_role("button", name="Restore the map").click()
    verdict(page, "ambiguous")
    page.get_by_role("button", name="Clear").click()
    expect(show).to_be_disabled()
    page.locator("#plan").focus()
    press(page, "b", 1)
    verdict(page, "usable")
    assert client.get("/v1/maps/page-rectangle").json()["segments"] == rectangle["segments"]
    client.delete("/v1/maps/page-rectangle")


def test_how_a_map_of_another_tool_was_read(page: Page, tmp_path: Path) -> None:
    svg = (
        '<svg xmlns="http://www.w3.org/2000/svg" width="6m" height="4m" viewBox="0 0 6 4">'
        '<path d="M0 0H6V4H0Z"/><text x="1" y="1">Hall</text></svg>'
    )
    (tmp_path / "plan.svg").write_text(svg)
    shown(page, "flat", "usable")
    about = page.locator("#about").inner_text()
    page.set_input_files("#files", [tmp_path / "plan.svg"])
    expect(page.locator("#reading")).to_contain_text("plan.svg: does not state its unit", timeout=60_000)
    expect(page.locator("#about")).to_have_text(about)
    page.get_by_label("Unit of a drawing").select_option("metres")
    expect(page.locator("#about")).to_contain_text("walls from plan.svg (svg)", timeout=60_000)
    report = page.locator("#report")
    expect(report).to_be_visible()
    for title in ("Findings", "Read", "Omitted", "Assumed"):
        expect(report.get_by_role("heading", name=title)).to_be_visible()
    expect(report).to_contain_text("text is not read: 1")
    expect(page.get_by_label("Example")).to_have_value("")
    page.get_by_label("Example").select_option(label="A flat")
    verdict(page, "usable")
    expect(report).to_be_hidden()


def test_a_request_is_taken_along(page: Page, client: httpx.Client, tmp_path: Path) -> None:
    shown(page, "flat", "usable")
    page.locator("#share summary").click()
    with page.expect_download() as download:
        page.get_by_role("button", name="Download the request").click()
    kept = tmp_path / "request.json"
    download.value.save_as(kept)
    assert client.post("/v1/associate", content=kept.read_bytes()).json()["usable"] is True
    page.get_by_role("button", name="Copy as curl").click()
    expect(page.locator("#copied")).to_have_text("Copied.")
    assert page.evaluate("navigator.clipboard.readText()").startswith(f"curl -s {client.base_url}".rstrip("/"))
    page.get_by_role("button", name="Copy as Python").click()
    expect(page.locator("#copied")).to_have_text("Copied.")
    program = page.evaluate("navigator.clipboard.readText()")
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False)
    assert ran.stdout.startswith("ok True"), ran.stderr
    page.set_input_files("#files", [kept])
    verdict(page, "usable")


def test_a_link_opens_the_stored_map_and_the_scan(page: Page, client: httpx.Client, tmp_path: Path) -> None:
    client.put("/v1/maps/page-room", json={"segments": examples.WALLS}).raise_for_status()
    page.goto("/")
    verdict(page, "ambiguous")
    page.set_input_files("#files", files(tmp_path, scan=SCAN))
    page.locator("#stored summary").click()
    page.get_by_role("button", name="Open page-room").click()
    verdict(page, "usable")
    page.get_by_label("Usable from probability").fill("0.9")
    page.locator("#share summary").click()
    page.get_by_role("button", name="Copy a link").click()
    expect(page.locator("#copied")).to_have_text("Copied.")
    link = page.evaluate("navigator.clipboard.readText()")
    page.goto("about:blank")
    with page.expect_request("**/v1/associate") as asked:
        page.goto(link)
    assert asked.value.post_data_json["map"] == {"map_id": "page-room"}
    assert asked.value.post_data_json["scan"] == SCAN
    assert asked.value.post_data_json["options"]["usable_from"] == 0.9
    verdict(page, "usable")
    expect(page.locator("#about")).to_have_text("The stored map page-room.")
    page.goto(link[: len(link) // 2])
    expect(page.locator("#message")).to_have_text("The link is damaged. Copy it again.")
    client.delete("/v1/maps/page-room")


MEANT_FOR_SHELLS = "a' & calc & $(id) `id` \" | \\ %PATH% ^ ! ; \u2018\u2019\u201a\u201b \n --output x <y >z \u2028 #"


@pytest.mark.parametrize("button", ["Copy as curl", "Copy as PowerShell", "Copy as Python"])
def test_what_is_copied_means_nothing_to_a_shell(page: Page, client: httpx.Client, tmp_path: Path, button: str) -> None:
    """Class of attack: a file with commands in it. Whoever opens it copies the request into some shell."""
    meta = {"note": MEANT_FOR_SHELLS}
    asked = {**examples.ASSOCIATE, "map": {**examples.ASSOCIATE["map"], "meta": meta}}
    (tmp_path / "request.json").write_text(json.dumps(asked))
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.goto("/")
    page.set_input_files("#files", [tmp_path / "request.json"])
    verdict(page, "usable")
    page.locator("#share summary").click()
    page.get_by_role("button", name=button).click()
    expect(page.locator("#copied")).to_have_text("Copied.")
    copied = page.evaluate("navigator.clipboard.readText()")
    if button == "Copy as Python":
        (line,) = [one for one in copied.splitlines() if one.startswith("asked = json.loads(")]
        body = json.loads(line.removeprefix("asked = json.loads(").removesuffix(")"))
    else:
        before, body, after = copied.split("'{")[0], "{" + copied.split("'{")[1].rsplit("'", 1)[0], copied[-1]
        assert (after, "'" in body) == ("'", False)
        assert before.count("'") in (0, 4)
    assert re.fullmatch(r"[A-Za-z0-9{}\[\]\",:.+\-_\\/]*", body)
    assert '\\"' not in body
    assert json.loads(body)["map"]["meta"] == meta
    assert client.post("/v1/associate", content=body).json()["usable"] is True


def test_nothing_comes_from_elsewhere(page: Page, service: RunningService) -> None:
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    shown(page, "office", "usable")
    assert len(asked) >= 5
    assert [url for url in asked if not url.startswith(service.url)] == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_accessible(browser: Browser, service: RunningService, scheme: str) -> None:
    """By axe, which the policy of the page blocks by default."""
    context = browser.new_context(base_url=service.url, bypass_csp=True, color_scheme=scheme)  # type: ignore[arg-type]
    page = context.new_page()
    shown(page, "office", "usable")
    for name in ("analysis", "stored", "share", "access"):
        page.locator(f"#{name} summary").click()
    page.get_by_role("button", name="Help").click()
    found = Axe().run(page).response["violations"]
    context.close()
    assert [(one["id"], [node["html"] for node in one["nodes"]]) for one in found] == []
