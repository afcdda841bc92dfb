"""The picture of the page in docs/guides/keep-the-map-true.md: ``python -m examples.changed_page``.

It starts the service, stores the warehouse of `examples.changed_building`, sends the scans of three days, and opens the
proposal in chromium, or in the browser that `LINEFIX_TEST_CHROMIUM` names. One change is refused, and one looked at.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
from pathlib import Path
from typing import Any

import httpx
import numpy as np
from playwright.sync_api import Page, expect, sync_playwright

import linefix

from .changed_building import warehouse
from .running import running_service

PICTURE = Path(__file__).parents[1] / "docs" / "changes-on-the-page.png"
SIZE = {"width": 1280, "height": 800}  # px
PATIENCE = 300_000  # ms for an answer of a busy machine


def main() -> int:
    """Take the picture."""
    chromium = os.environ.get("LINEFIX_TEST_CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        print("no chromium is installed; install one, or name it in LINEFIX_TEST_CHROMIUM", file=sys.stderr)
        return 1
    with running_service(max_deadline_ms=PATIENCE) as (url, _), sync_playwright() as playwright:
        proposal = proposed(url)
        if not proposal["changes"]:
            print("the service proposed no changes; if it had too little time, try again", file=sys.stderr)
            return 1
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(viewport=SIZE, color_scheme="light")
        page.set_default_timeout(PATIENCE)
        page.goto(url)
        show(page, proposal)
        page.screenshot(path=PICTURE)
        browser.close()
    print(f"Picture: {PICTURE}, {len(proposal['changes'])} changes")
    return 0


def proposed(url: str) -> dict[str, Any]:
    """Store the old map, and return the changes that the service proposes."""
    mapped, _, visits = warehouse()
    with httpx.Client(base_url=url, timeout=PATIENCE / 1e3) as client:
        document = {"segments": mapped.endpoints.tolist(), "sigma": 0.005}
        client.put("/v1/maps/warehouse", json=document).raise_for_status()
        body = {"visits": [{"visit": day, "scans": [sent(one) for one in scans]} for day, scans in visits.items()]}
        answer: dict[str, Any] = client.post("/v1/maps/warehouse:update", json=body).raise_for_status().json()
    return answer


def sent(one: linefix.LaserScan) -> dict[str, Any]:
    """Return a scan as a request has it; a range above the greatest is a beam without return."""
    ranges = np.where(np.isfinite(one.ranges), one.ranges, 2.0 * one.range_max).round(4).tolist()
    return {
        "laser": {
            "angle_min": one.angle_min,
            "angle_increment": one.angle_increment,
            "range_max": one.range_max,
            "ranges": ranges,
        }
    }


def show(page: Page, proposal: dict[str, Any]) -> None:
    """Open the proposal, refuse its last change, and look at the first."""
    content = json.dumps(proposal).encode()
    page.locator("#files").set_input_files({"name": "proposal.json", "mimeType": "application/json", "buffer": content})
    expect(page.locator("#with-proposal")).to_be_visible()
    rows = page.locator("#change-list input")
    rows.last.uncheck()
    page.locator("#changes").evaluate("(box) => box.scrollIntoView()")
    rows.first.focus()
    expect(page.locator("#evidence")).to_contain_text("Confidence")


if __name__ == "__main__":
    sys.exit(main())
