"""Several stored maps on the page: thumbnails with their verdicts, and one map large."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Locator, Page, expect

from linefix.documents import examples
from tests.running import RunningService

from .plan import Plan, box_of, verdict

HALL = [[0, 0, 9, 0], [9, 0, 9, 4.5], [9, 4.5, 0, 4.5], [0, 4.5, 0, 0]]
YARD = [[0, 0, 12, 0], [12, 0, 12, 7], [12, 7, 5, 7], [5, 7, 5, 9], [5, 9, 0, 9], [0, 9, 0, 0]]
FLOORS = {"page-tower-1": HALL, "page-tower-2": examples.WALLS, "page-tower-3": YARD}
TWINS = ("page-twin-1", "page-twin-2")
# The bounds of the room, and of a thumbnail: its middle is the middle of the map.
ROOM = (-4.0, -3.0, 4.0, 3.0)
THUMBNAIL = """(canvas, at) => {
  const ratio = canvas.width / canvas.clientWidth;
  return [...canvas.getContext("2d").getImageData(Math.round(at[0] * ratio), Math.round(at[1] * ratio), 1, 1).data];
}"""


@pytest.fixture
def stored(client: httpx.Client) -> Iterator[None]:
    maps = {**FLOORS, **dict.fromkeys(TWINS, examples.WALLS)}
    for name, walls in maps.items():
        client.put(f"/v1/maps/{name}", json={"segments": walls}).raise_for_status()
    yield
    for name in maps:
        client.delete(f"/v1/maps/{name}")


def open_scan(page: Page, folder: Path) -> None:
    (folder / "scan.json").write_text(json.dumps({"segments": examples.SEEN, "sigma": 0.02}))
    page.goto("/")
    verdict(page, "ambiguous")
    page.set_input_files("#files", [folder / "scan.json"])
    page.locator("#stored summary").click()


def by_prefix(page: Page, prefix: str) -> None:
    page.get_by_label("Begin with").fill(prefix)
    page.get_by_role("button", name="Search on several").click()


def thumbnail(page: Page, name: str) -> Locator:
    return page.locator("#floors button").filter(has_text=name)


def is_large(page: Page, name: str) -> None:
    expect(page.locator("#floors button[aria-pressed=true]")).to_contain_text(name)
    expect(page.locator("#about")).to_contain_text(f"The stored map {name}, one of")


@pytest.mark.usefixtures("stored")
def test_maps_that_begin_so_are_searched_together(page: Page, tmp_path: Path) -> None:
    open_scan(page, tmp_path)
    by_prefix(page, "page-tower-")
    verdict(page, "usable")
    is_large(page, "page-tower-2")
    expect(page.locator("#numbers")).to_contain_text("page-tower-2")
    expect(page.locator("#numbers")).to_contain_text("1.000 m, 0.500 m")
    expect(page.locator("#floors button")).to_have_count(3)
    expect(thumbnail(page, "page-tower-2").locator("small")).to_contain_text("ok, ")
    expect(thumbnail(page, "page-tower-2")).to_have_attribute("data-state", "usable")
    for name in ("page-tower-1", "page-tower-3"):
        expect(thumbnail(page, name).locator("small")).to_contain_text("no match, 0.00 %")
    # The robot is 1 m right of the middle of the map, and 0.5 m above it.
    scale = 0.9 * min(132 / 8, 84 / 6)
    canvas = thumbnail(page, "page-tower-2").locator("canvas")
    assert canvas.evaluate(THUMBNAIL, [66 + 1.0 * scale, 42 - 0.5 * scale])[3] == 255
    assert canvas.evaluate(THUMBNAIL, [66 - 1.0 * scale, 42 - 0.5 * scale])[3] == 0


@pytest.mark.usefixtures("stored")
def test_a_click_shows_a_map_large(page: Page, tmp_path: Path) -> None:
    open_scan(page, tmp_path)
    by_prefix(page, "page-tower-")
    verdict(page, "usable")
    is_large(page, "page-tower-2")
    room = Plan(page, ROOM)
    wall_of_room = room.colour(-4.0, 2.0)
    assert wall_of_room[3] > 0
    thumbnail(page, "page-tower-1").click()
    is_large(page, "page-tower-1")
    verdict(page, "usable")  # still that of the answer
    hall = Plan(page, (0.0, 0.0, 9.0, 4.5))
    for y in (1.1, 2.2, 3.3):
        page.mouse.move(*hall.at(9.0, y))
        expect(page.locator("#hover")).to_contain_text("wall 1")
    expect(page.locator("#legend")).not_to_contain_text("scan segment on a wall")
    thumbnail(page, "page-tower-2").click()
    is_large(page, "page-tower-2")
    expect(page.locator("#legend")).to_contain_text("scan segment on a wall")
    assert room.colour(-4.0, 2.0) == wall_of_room


@pytest.mark.usefixtures("stored")
def test_maps_are_selected_and_alternatives_lead_from_one_to_the_other(page: Page, tmp_path: Path) -> None:
    open_scan(page, tmp_path)
    for name in TWINS:
        page.get_by_label(f"{name} (6 walls)").check()
    page.get_by_role("button", name="Search on several").click()
    verdict(page, "ambiguous")
    expect(page.locator("#floors button")).to_have_count(2)
    for name in TWINS:
        expect(thumbnail(page, name).locator("small")).to_contain_text("ambiguous, ")
    first = page.locator("#numbers dd").nth(1).inner_text()
    (second,) = {*TWINS} - {first}
    is_large(page, first)
    page.get_by_role("button", name="Next pose").click()
    expect(page.locator("#other")).to_contain_text(f"map {second}")
    is_large(page, second)
    expect(page.locator("#legend")).to_contain_text("alternative")
    page.get_by_role("button", name="Previous pose").click()
    is_large(page, first)
    page.get_by_role("button", name="Next pose").click()
    is_large(page, second)
    thumbnail(page, first).click()
    is_large(page, first)
    expect(page.locator("#other")).to_have_text("1 alternative")
    thumbnail(page, second).focus()
    page.keyboard.press("Enter")
    is_large(page, second)
    expect(page.locator("#legend")).to_contain_text("best pose on this map")
    assert page.evaluate("document.activeElement.querySelector('span').textContent") == second


@pytest.mark.usefixtures("stored")
def test_a_simulated_robot_stays_on_its_map(page: Page, tmp_path: Path) -> None:
    page.goto("/")
    verdict(page, "ambiguous")
    page.locator("#stored summary").click()
    robot = page.get_by_label("simulate the scan")
    expect(robot).to_be_checked()
    by_prefix(page, "page-tower-")
    expect(page.locator("#numbers")).to_contain_text("page-tower-1")
    verdict(page, "ambiguous")  # in the middle of a rectangle
    expect(page.locator("#floors button[aria-pressed=true]")).to_contain_text("page-tower-1")
    thumbnail(page, "page-tower-3").click()
    is_large(page, "page-tower-3")
    expect(robot).not_to_be_checked()
    verdict(page, "ambiguous")
    robot.check()
    verdict(page, "usable")
    expect(thumbnail(page, "page-tower-3")).to_have_attribute("data-state", "usable")
    page.get_by_label("Example").select_option(label="A flat")
    expect(page.locator("#floors")).to_be_hidden()


@pytest.mark.usefixtures("stored")
def test_two_maps_at_least_are_needed(page: Page, tmp_path: Path) -> None:
    open_scan(page, tmp_path)
    for prefix, message in (
        ("", "Tick two maps at least"), ("page-tower-2", "One stored map begins"), ("roof", "No stored map begins"),
    ):  # fmt: skip
        by_prefix(page, prefix)
        expect(page.locator("#findings")).to_contain_text(message)
    expect(page.locator("#floors")).to_be_hidden()


@pytest.mark.usefixtures("stored")
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_thumbnails_are_accessible(browser: Browser, service: RunningService, tmp_path: Path, scheme: str) -> None:
    """On a telephone, too: the row scrolls, the page does not."""
    context = browser.new_context(
        base_url=service.url, bypass_csp=True, color_scheme=scheme, viewport={"width": 360, "height": 740}  # type: ignore[arg-type]
    )  # fmt: skip
    page = context.new_page()
    open_scan(page, tmp_path)
    by_prefix(page, "page-t")
    verdict(page, "ambiguous")
    expect(page.locator("#floors button")).to_have_count(5)
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert box_of(page, "#floors")["width"] <= 360
    found = Axe().run(page).response["violations"]
    context.close()
    assert [(one["id"], [node["html"] for node in one["nodes"]]) for one in found] == []
