"""The drawing of the plan, and its legend."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from formats import VERDICTS
from tests.service.importing.forms import room_grid

from .plan import ROOMS, Plan, box_of, shown, verdict

WEB = Path(__file__).parents[3] / "web" / "src"


def test_verdicts_have_the_colours_of_the_pictures_in_documents() -> None:
    style = (WEB / "style.css").read_text()
    light = style[: style.index("prefers-color-scheme")]
    for name, colour in VERDICTS.items():
        assert f"--{name}: {colour};" in light, name


def legend(page: Page) -> list[str]:
    return page.locator("#legend .key").all_inner_texts()


def test_the_legend_has_what_is_drawn_and_nothing_else(page: Page) -> None:
    shown(page, "flat", "usable")
    drawn = ["wall", "true pose", "measured point", "scan segment on a wall"]
    *first, estimate = legend(page)
    assert first == drawn
    assert re.fullmatch(r"estimated pose with 3 sigma(, drawn \d+ times larger)?", estimate)
    shown(page, "rooms", "ambiguous")
    page.get_by_role("button", name="Next pose").click()
    assert legend(page) == ["wall", "true pose", "alternative"]
    shown(page, "office", "usable")
    assert "scan segment on no wall" in legend(page)
    shown(page, "corridor", "degenerate")
    assert "estimated pose with the unobservable direction" in legend(page)
    assert not {"usable", "ambiguous", "no match"} & {*legend(page)}


def test_nothing_lies_over_the_plan(page: Page) -> None:
    shown(page, "office", "usable")
    plan = box_of(page, "#plan")
    for selector in ("#inset", "#legend", "#tools", "#verdict"):
        box = box_of(page, selector)
        apart = (
            box["x"] >= plan["x"] + plan["width"]
            or box["x"] + box["width"] <= plan["x"]
            or box["y"] >= plan["y"] + plan["height"]
            or box["y"] + box["height"] <= plan["y"]
        )
        assert apart, selector


def test_the_bar_is_as_long_as_it_says(page: Page) -> None:
    shown(page, "rooms", "ambiguous")
    plan, bar = Plan(page, ROOMS), page.locator("#bar")
    fitted = bar.evaluate("bar => getComputedStyle(bar).width")
    for _ in range(3):
        told = page.locator("#length").inner_text()
        number, unit = re.match(r"([\d.]+) (m|cm), grid \d+ m$", told).groups()  # type: ignore[union-attr]
        metres = float(number) * (0.01 if unit == "cm" else 1.0)
        assert box_of(page, "#bar")["width"] == pytest.approx(metres * plan.scale(), abs=1.0)
        page.get_by_role("button", name="Zoom in").click()
        expect(bar).not_to_have_css("width", fitted)
        page.get_by_role("button", name="Fit").click()
        expect(bar).to_have_css("width", fitted)  # drawn in the next frame


def test_layers_are_switched(page: Page) -> None:
    """A wall, free space with beams alone, and the pose of an alternative."""
    with page.expect_response("**/v1/associate") as response:
        shown(page, "rooms", "ambiguous")
    plan, other = Plan(page, ROOMS), response.value.json()["alternatives"][0]["pose"]
    places = {"map": (2.0, 0.0), "beams": (5.4, 4.0), "alternatives": (other["x"], other["y"])}
    page.get_by_role("button", name="Layers").click()
    for layer, place in places.items():
        drawn = plan.colour(*place)
        page.locator("#layers").get_by_label(layer).click()
        page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        assert plan.colour(*place) != drawn, layer
    expect(page.locator("#legend")).not_to_contain_text("wall that")
    assert legend(page)[:5] == ["true pose", "measured point", "beam", "scan segment on a wall", legend(page)[-1]]
    for layer in ("scan", "correspondences"):
        page.locator("#layers").get_by_label(layer).click()
    assert legend(page)[:2] == ["true pose", "beam"]
    page.keyboard.press("Escape")
    expect(page.locator("#layers")).to_be_hidden()
    expect(page.get_by_role("button", name="Layers")).to_have_attribute("aria-expanded", "false")


def test_an_imported_grid_lies_under_its_walls(page: Page, tmp_path: Path) -> None:
    """A room of 8 by 5 m with a pillar of 1 m, and a wall of 20 cm about it."""
    for name, content in room_grid().items():
        (tmp_path / name).write_bytes(content)
    page.goto("/")
    page.set_input_files("#files", [tmp_path / name for name in room_grid()])
    expect(page.locator("#about")).to_contain_text("(map_server)", timeout=60_000)
    expect(page.locator("#legend")).to_contain_text("imported grid")
    # Corners of the free space, which is cells 20 to 180 and 20 to 120 from (-1, -2), and a cell of 5 cm.
    plan = Plan(page, (0.0, -1.0, 8.0, 4.0))
    page.get_by_role("button", name="Fit").click()
    page.get_by_label("simulate the scan").uncheck()
    free, pillar, outside = (4.45, 2.55), (2.55, 2.05), (4.45, -1.4)
    expect(page.locator("#legend")).not_to_contain_text("true pose")
    light, dark, unknown = (plan.colour(*place) for place in (free, pillar, outside))
    assert min(light[:3]) > 240
    assert max(dark[:3]) < 40
    assert 150 < unknown[0] < 240
    assert len({light[3], dark[3], unknown[3]}) == 1
    page.get_by_label("Example").select_option(label="A flat")
    verdict(page, "usable")
    expect(page.locator("#legend")).not_to_contain_text("imported grid")


def test_the_heat_map_ends_at_the_walls(page: Page) -> None:
    """Between two rooms are 15 cm of wall, and above them is nothing."""
    shown(page, "rooms", "ambiguous")
    page.locator("#analysis summary").click()
    page.get_by_label("Spacing").fill("1")
    page.get_by_role("button", name="Analyze").click()
    expect(page.locator("#analyzed")).to_contain_text("Localization succeeds at", timeout=60_000)
    plan = Plan(page, ROOMS)
    ys = np.arange(2.3, 5.0, 0.3)
    painted = [sum(plan.colour(x, y)[3] > 60 for y in ys) for x in (3.7, 4.5, 7.9, 8.5)]
    assert sum(painted) > 20  # the rooms on both sides are
    walls = [(4.075, y) for y in ys] + [(8.225, y) for y in ys] + [(x, 5.3) for x in np.arange(0.25, 12.3, 0.3)]
    assert [place for place in walls if plan.colour(*place)[3] > 60] == []


def test_alternatives_are_counted_as_in_the_message_and_have_their_own_numbers(page: Page) -> None:
    with page.expect_response("**/v1/associate") as response:
        shown(page, "rooms", "ambiguous")
    answer = response.value.json()
    expect(page.locator("#message")).to_contain_text("2 other poses fit")
    other = page.locator("#other")
    expect(other).to_have_text("2 alternatives")
    for k, one in enumerate(answer["alternatives"][:2]):
        page.get_by_role("button", name="Next pose").click()
        expect(other).to_contain_text(f"Alternative {k + 1} of 2: probability {100 * one['probability']:.2f} %")
        expect(other).to_contain_text(f"{one['pose']['x']:.3f} m, {one['pose']['y']:.3f} m")
    page.get_by_role("button", name="Next pose").click()
    expect(other).to_have_text("2 alternatives")
    assert sum(one["probability"] for one in answer["alternatives"]) + answer["probability"] <= 1.0
