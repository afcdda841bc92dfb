"""Functions that tests of the page share: waiting for a verdict, and the colours at a place of the plan."""

from __future__ import annotations

from dataclasses import dataclass

from playwright.sync_api import Page, expect

PIXEL = """([x, y]) => {
  const canvas = document.querySelector("#plan");
  const ratio = window.devicePixelRatio;
  return [...canvas.getContext("2d").getImageData(Math.round(x * ratio), Math.round(y * ratio), 1, 1).data];
}"""


def verdict(page: Page, state: str) -> None:
    expect(page.locator("#verdict")).to_have_attribute("data-state", state, timeout=30_000)


def shown(page: Page, example: str, state: str) -> None:
    page.goto(f"/?example={example}")
    verdict(page, state)


@dataclass(frozen=True)
class Plan:
    """The plan as it is when a map is opened: the whole map, with a margin.

    Attributes
    ----------
    bounds : tuple of float
        Of the map: least x and y, greatest x and y; metres.
    """

    page: Page
    bounds: tuple[float, float, float, float]

    def box(self) -> dict[str, float]:
        """Return where the canvas is."""
        return box_of(self.page, "#plan")

    def scale(self) -> float:
        """Return pixels in a metre."""
        low_x, low_y, high_x, high_y = self.bounds
        box = self.box()
        return 0.88 * min(box["width"] / (high_x - low_x), box["height"] / (high_y - low_y))

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Return a place in the page's pixels."""
        box, scale, (low_x, low_y, high_x, high_y) = self.box(), self.scale(), self.bounds
        return (
            box["x"] + box["width"] / 2 + (x - (low_x + high_x) / 2) * scale,
            box["y"] + box["height"] / 2 - (y - (low_y + high_y) / 2) * scale,
        )

    def colour(self, x: float, y: float) -> list[int]:
        """Return red, green, blue and alpha of what is drawn at a place."""
        box, (px, py) = self.box(), self.at(x, y)
        return self.page.evaluate(PIXEL, [px - box["x"], py - box["y"]])


ROOMS = (-1.0, 0.0, 12.6, 5.15)  # bounds of the example


def box_of(page: Page, selector: str) -> dict[str, float]:
    """Return where an element is on the page."""
    found = page.locator(selector).bounding_box()
    assert found is not None, selector
    return dict(found)
