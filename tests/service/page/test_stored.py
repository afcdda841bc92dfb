"""Stored maps on the page."""

from __future__ import annotations

import httpx
from playwright.sync_api import Page, Route, expect

from .plan import shown, verdict


def test_a_late_example_does_not_replace_an_opened_map(page: Page, client: httpx.Client) -> None:
    walls = {"segments": [[0, 0, 8, 0], [8, 0, 8, 5], [8, 5, 3, 5], [3, 5, 0, 4], [0, 4, 0, 0]]}
    client.put("/v1/maps/page-chosen", json=walls).raise_for_status()
    on_the_way: list[Route] = []
    page.route("**/page/examples/*.json", lambda route: on_the_way.append(route))
    with page.expect_request("**/page/examples/*.json"):
        page.goto("/")
    page.locator("#stored summary").click()
    page.get_by_role("button", name="Open page-chosen").click()
    about = page.locator("#about")
    expect(about).to_have_text("The stored map page-chosen.")
    with page.expect_response("**/page/examples/*.json") as arrived:
        on_the_way[0].continue_()
    arrived.value.finished()
    page.get_by_label("simulate the scan").check()
    verdict(page, "usable")
    expect(about).to_have_text("The stored map page-chosen.")
    page.unroute("**/page/examples/*.json")
    client.delete("/v1/maps/page-chosen")


def test_a_virtual_robot_waits_for_its_map(page: Page, client: httpx.Client) -> None:
    """A robot that is switched on while its map is read stays on."""
    walls = {"segments": [[0, 0, 8, 0], [8, 0, 8, 5], [8, 5, 3, 5], [3, 5, 0, 4], [0, 4, 0, 0]]}
    client.put("/v1/maps/page-late", json=walls).raise_for_status()
    page.goto("/")
    robot = page.get_by_label("simulate the scan")
    verdict(page, "ambiguous")
    robot.uncheck()
    on_the_way: list[Route] = []
    page.route("**/v1/maps/page-late", lambda route: on_the_way.append(route))
    page.locator("#stored summary").click()
    with page.expect_request("**/v1/maps/page-late"):
        page.get_by_role("button", name="Open page-late").click()
    robot.check()
    on_the_way[0].continue_()
    verdict(page, "usable")
    expect(robot).to_be_checked()
    page.unroute("**/v1/maps/page-late")
    client.delete("/v1/maps/page-late")


def test_stored_maps(page: Page, client: httpx.Client) -> None:
    shown(page, "flat", "usable")
    page.locator("#stored summary").click()
    page.get_by_label("Name").fill("a flat")
    page.get_by_role("button", name="Store this map").click()
    expect(page.locator("#findings")).to_contain_text("letters")
    page.get_by_label("Name").fill("page-flat")
    page.get_by_role("button", name="Store this map").click()
    expect(page.locator("#findings")).to_contain_text("page-flat is stored")
    assert client.get("/v1/maps/page-flat").status_code == 200
    page.get_by_role("button", name="Open page-flat").click()
    expect(page.locator("#about")).to_have_text("The stored map page-flat.")
    page.get_by_role("button", name="Check page-flat").click()
    expect(page.locator("#findings")).not_to_contain_text("Checking", timeout=30_000)
    page.once("dialog", lambda dialog: dialog.accept())
    page.get_by_role("button", name="Delete page-flat").click()
    expect(page.locator("#findings")).to_contain_text("page-flat is deleted")
    assert client.get("/v1/maps/page-flat").status_code == 404
