"""Film the page for the README: ``python -m examples.animation`` writes ``docs/page.gif``.

It starts the service, or takes the one whose URL is given, and opens the page in chromium, or in the browser that
`LINEFIX_TEST_CHROMIUM` names. It drags the robot from one of three equal rooms to the corridor and into another room.
Each frame is the page after the answer to a move.
"""

from __future__ import annotations

import io
import math
import os
import shutil
import sys
from contextlib import nullcontext
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Page, expect, sync_playwright

from .running import running_service
from .scenes import rooms

DOCS = Path(__file__).parents[1] / "docs"
SIZE = {"width": 1120, "height": 600}  # px
WIDTH = 860  # px of a frame
COLOURS = 128
SAMPLES = 4  # frames that the colours are taken from
WAY = [(6.75, 4.2), (5.4, 2.9), (5.2, 1.0), (1.2, 1.0), (1.05, 2.2), (2.0, 3.9)]  # m
STEP = 0.35  # m from frame to frame
PACE, HOLD = 120, 1500  # ms of a frame, and of one at which there is something to read
PATIENCE = 120_000  # ms for an answer of a busy machine
FILLED = 0.88  # of the plan, by the map


@dataclass(frozen=True)
class Frame:
    """A picture of the page, and for how many ms it is shown."""

    picture: Image.Image
    shown: int


def main() -> int:
    """Write the animation."""
    chromium = os.environ.get("LINEFIX_TEST_CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        print("no chromium is installed; install one, or name it in LINEFIX_TEST_CHROMIUM", file=sys.stderr)
        return 1
    given = nullcontext((sys.argv[1], 0)) if len(sys.argv) > 1 else running_service()
    with given as (url, _), sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        frames = filmed(browser, url)
        browser.close()
    first, *others = reduced([one.picture for one in frames])
    path = DOCS / "page.gif"
    durations = [one.shown for one in frames]
    first.save(path, save_all=True, append_images=others, duration=durations, loop=0, optimize=True)
    print(f"{path}: {len(frames)} frames, {path.stat().st_size / 1e6:.2f} MB")
    return 0


def filmed(browser: Browser, url: str) -> list[Frame]:
    """Return the page while the robot is dragged along the way."""
    page = browser.new_page(viewport=SIZE, color_scheme="light")
    page.set_default_timeout(PATIENCE)
    page.goto(f"{url}/?example=rooms")
    expect(page.locator("#verdict")).to_have_attribute("data-state", "ambiguous", timeout=PATIENCE)
    frames = [Frame(pictured(page), HOLD)]
    page.mouse.move(*place_of(page, *WAY[0]))
    page.mouse.down()
    verdict = "ambiguous"
    for x, y in moves():
        with page.expect_response("**/v1/associate") as answered:
            page.mouse.move(*place_of(page, x, y))
        answer = answered.value.json()
        said = answer["message"].partition(": see `reasons`")[0]  # which the page shows below
        expect(page.locator("#message")).to_contain_text(said, timeout=PATIENCE)
        state = "usable" if answer["usable"] else answer["status"]
        frames.append(Frame(pictured(page), PACE if state == verdict else HOLD))
        verdict = state
    page.mouse.up()
    for _ in range(page.locator("#next-other").count() * 2):
        page.locator("#next-other").click()
        frames.append(Frame(pictured(page), HOLD))
    return frames


def moves() -> list[tuple[float, float]]:
    """Return the places of the robot, metres."""
    found = []
    for (ax, ay), (bx, by) in pairwise(WAY):
        count = max(1, round(math.hypot(bx - ax, by - ay) / STEP))
        found += [(ax + (bx - ax) * k / count, ay + (by - ay) * k / count) for k in range(1, count + 1)]
    return found


def place_of(page: Page, x: float, y: float) -> tuple[float, float]:
    """Return where a place of the map is on the screen; the page fits the plan when it opens."""
    box = page.locator("#plan").bounding_box()
    assert box is not None
    ends = rooms().walls.reshape(-1, 2)
    low, high = ends.min(axis=0), ends.max(axis=0)
    scale = FILLED * min(box["width"] / (high[0] - low[0]), box["height"] / (high[1] - low[1]))
    middle = (low + high) / 2
    return (
        float(box["x"] + box["width"] / 2 + (x - middle[0]) * scale),
        float(box["y"] + box["height"] / 2 - (y - middle[1]) * scale),
    )


def pictured(page: Page) -> Image.Image:
    """Return the page as it is now."""
    return Image.open(io.BytesIO(page.screenshot())).convert("RGB")


def reduced(pictures: list[Image.Image]) -> list[Image.Image]:
    """Return pictures as frames: smaller, and of the same few colours, thin lines among them."""
    size = (WIDTH, round(pictures[0].height * WIDTH / pictures[0].width))
    small = [one.resize(size, Image.Resampling.LANCZOS) for one in pictures]
    shown = small[:: max(1, len(small) // SAMPLES)] + small[-1:]
    together = Image.new("RGB", (size[0], size[1] * len(shown)))
    for k, one in enumerate(shown):
        together.paste(one, (0, k * size[1]))
    palette = together.quantize(COLOURS, Image.Quantize.MAXCOVERAGE)
    return [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in small]


if __name__ == "__main__":
    sys.exit(main())
