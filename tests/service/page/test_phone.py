"""The page on a phone: 390 by 844 pixels, and fingers."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, CDPSession, Page, expect

from tests.running import RunningService, until

from .plan import ROOMS, Plan, box_of, shown

LEAST = 40.0  # px of a control
STEPS = 10


@pytest.fixture
def phone(browser: Browser, service: RunningService) -> Iterator[Page]:
    context = browser.new_context(
        base_url=service.url, viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True
    )
    page = context.new_page()
    shown(page, "rooms", "ambiguous")
    yield page
    context.close()


def touch(page: Page) -> CDPSession:
    return page.context.new_cdp_session(page)


def drag(page: Page, *ways: tuple[tuple[float, float], tuple[float, float]]) -> None:
    """Move fingers, each along its way."""
    session = touch(page)

    def points(part: float) -> list[dict[str, float]]:
        return [{"x": a + part * (c - a), "y": b + part * (d - b), "id": k} for k, ((a, b), (c, d)) in enumerate(ways)]

    session.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": points(0.0)})
    for k in range(1, STEPS + 1):
        session.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": points(k / STEPS)})
    session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})


def scrolled(page: Page) -> float:
    return page.evaluate("window.scrollY")


def test_nothing_is_wider_than_the_screen(phone: Page) -> None:
    assert phone.evaluate("document.documentElement.scrollWidth") <= 390


def test_a_finger_beside_the_robot_scrolls(phone: Page) -> None:
    box = box_of(phone, "#plan")
    x, y = box["x"] + 60, box["y"] + box["height"] - 40
    drag(phone, ((x, y), (x, y - 200)))
    until(lambda: scrolled(phone) > 50.0)


def test_a_finger_drags_the_robot(phone: Page) -> None:
    """Out of the room, where the verdict changes; the page stays where it is."""
    plan = Plan(phone, ROOMS)
    drag(phone, (plan.at(6.75, 4.2), plan.at(4.0, 1.0)))
    expect(phone.locator("#verdict")).to_have_attribute("data-state", "usable", timeout=30_000)
    assert scrolled(phone) == 0.0


def test_two_fingers_zoom(phone: Page) -> None:
    before = phone.locator("#length").inner_text()
    box = box_of(phone, "#plan")
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    drag(phone, ((x - 30, y), (x - 150, y)), ((x + 30, y), (x + 150, y)))
    expect(phone.locator("#length")).not_to_have_text(before)
    assert scrolled(phone) == 0.0


def test_controls_are_large_enough_for_a_finger(phone: Page) -> None:
    for name in ("analysis", "stored", "share", "access"):
        phone.locator(f"#{name} summary").click()
    small = []
    controls = phone.locator("button, select, summary, nav a, input:not([type=checkbox]), label.check")
    for one in controls.all():
        if not one.is_visible():
            continue
        box = one.bounding_box()
        assert box is not None
        if min(box["width"], box["height"]) < LEAST - 0.5:
            small.append((one.evaluate("it => it.outerHTML.slice(0, 60)"), box["width"], box["height"]))
    assert small == []
