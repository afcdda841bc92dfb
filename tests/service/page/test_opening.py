"""The page opens with an example, and opens files."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, Response, Route, expect

from examples.sample import OfficePlan, offices, way_through, with_furniture, write_drive, write_grid
from tests.service.http.test_maps_searched import MAP, SCAN
from tests.service.importing.forms import SQUARE, room_grid

from .plan import shown, verdict

NOT_READY = {
    "title": "The service is not ready", "status": 503, "code": "not_ready",
    "detail": "the kernels are being compiled, 40% so far; send the request again later",
}  # fmt: skip


def test_it_opens_with_an_example(page: Page) -> None:
    page.goto("/")
    verdict(page, "ambiguous")
    expect(page.get_by_label("Example")).to_have_value("rooms")
    expect(page.locator("#hint")).to_be_hidden()


def test_it_searches_as_soon_as_the_service_is_ready(page: Page) -> None:
    page.route("**/v1/associate", lambda route: route.fulfill(status=503, json=NOT_READY))
    page.goto("/")
    verdict(page, "waiting")
    expect(page.locator("#message")).to_have_text(NOT_READY["detail"])
    page.unroute("**/v1/associate")
    verdict(page, "ambiguous")


def test_files_wait_for_those_that_are_read(page: Page, tmp_path: Path) -> None:
    """A drawing that cannot be read, a map and a scan, each opened while the one before is being read."""
    (tmp_path / "a.dxf").write_text("0")
    (tmp_path / "square.csv").write_bytes(SQUARE)
    (tmp_path / "scan.json").write_text(json.dumps(SCAN))
    shown(page, "flat", "usable")
    waiting: list[Route] = []
    page.route("**/v1/maps:import", lambda route: waiting.append(route))
    with page.expect_request("**/v1/maps:import"):
        page.set_input_files("#files", [tmp_path / "a.dxf"])
    for name in ("square.csv", "scan.json"):
        page.set_input_files("#files", [tmp_path / name])
    expect(page.locator("#reading")).to_have_text("Reading a.dxf ...")
    assert len(waiting) == 1
    waiting[0].continue_()
    then = re.compile(r"^.*a\.dxf.+ Reading square\.csv \.\.\.$")
    expect(page.locator("#reading")).to_have_text(then, timeout=60_000)
    assert len(waiting) == 2
    is_scan = lambda asked: asked.url.endswith("/associate") and asked.post_data_json["scan"] == SCAN  # noqa: E731
    with page.expect_request(is_scan, timeout=60_000):
        waiting[1].continue_()
    expect(page.locator("#about")).to_contain_text("walls from square.csv")
    expect(page.locator("#reading")).to_contain_text("a.dxf: ")
    expect(page.locator("body")).not_to_contain_text("Reading")


def test_a_grid_needs_its_picture(page: Page, tmp_path: Path) -> None:
    (tmp_path / "hq.yaml").write_text("image: 'pictures/hq floor.pgm' # drawn\nresolution: 0.05\norigin: [0, 0, 0]\n")
    page.goto("/")
    page.set_input_files("#files", [tmp_path / "hq.yaml"])
    expect(page.locator("#reading")).to_have_text("hq.yaml needs hq floor.pgm: choose both.")
    (tmp_path / "hq floor.pgm").write_bytes(b"P5 1 1 255 0")
    page.set_input_files("#files", [tmp_path / "hq floor.pgm"])
    expect(page.locator("#reading")).to_have_text("hq floor.pgm needs its YAML file: choose both.")


def drop(page: Page, *paths: Path) -> None:
    """Drop files and folders on the plan, as a file manager does."""
    data = {"items": [], "files": [str(path) for path in paths], "dragOperationsMask": 1}
    session = page.context.new_cdp_session(page)
    for kind in ("dragEnter", "dragOver", "drop"):
        session.send("Input.dispatchDragEvent", {"type": kind, "x": 500, "y": 400, "data": data})


def bounds_of(answer: Response) -> np.ndarray:
    """Return the least and greatest x and y of an imported map, metres."""
    corners = np.array(answer.json()["map"]["segments"]).reshape(-1, 2)
    return np.concatenate([corners.min(axis=0), corners.max(axis=0)])


def test_a_folder_is_dropped(page: Page, tmp_path: Path) -> None:
    """A grid in a folder inside of it, and a hidden file that no program reads; next to it a scan."""
    (tmp_path / "site" / "map").mkdir(parents=True)
    for name, content in room_grid().items():
        (tmp_path / "site" / "map" / name).write_bytes(content)
    (tmp_path / "scan.json").write_text(json.dumps(SCAN))
    (tmp_path / "site" / ".DS_Store").write_bytes(b"0")
    shown(page, "flat", "usable")
    is_scan = lambda asked: asked.url.endswith("/associate") and asked.post_data_json["scan"] == SCAN  # noqa: E731
    with page.expect_request(is_scan, timeout=60_000):
        drop(page, tmp_path / "site", tmp_path / "scan.json")
    expect(page.locator("#about")).to_contain_text("walls from room.yaml", timeout=60_000)
    expect(page.locator("#reading")).to_be_empty()


def test_a_folder_of_too_many_files_is_refused(page: Page, tmp_path: Path) -> None:
    (tmp_path / "site").mkdir()
    for number in range(120):
        (tmp_path / "site" / f"{number}.csv").write_bytes(SQUARE)
    shown(page, "flat", "usable")
    drop(page, tmp_path / "site")
    expect(page.locator("#reading")).to_contain_text("has more than 64 files")


def test_the_surface_of_walls_is_set(page: Page, tmp_path: Path) -> None:
    for name, content in room_grid().items():
        (tmp_path / name).write_bytes(content)
    shown(page, "flat", "usable")
    with page.expect_response("**/v1/maps:import", timeout=60_000) as answer:
        page.set_input_files("#files", [tmp_path / name for name in room_grid()])
    front = bounds_of(answer.value)
    page.get_by_label("Surface of walls").fill("2")
    with page.expect_response("**/v1/maps:import", timeout=60_000) as answer:
        page.get_by_label("Surface of walls").press("Enter")
    assert bounds_of(answer.value) == pytest.approx(front + np.array([-0.1, -0.1, 0.1, 0.1]), abs=0.02)


def test_an_example_that_is_chosen_meanwhile_stays(page: Page, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(SQUARE)
    shown(page, "rooms", "ambiguous")
    waiting: list[Route] = []
    page.route("**/v1/maps:import", lambda route: waiting.append(route))
    with page.expect_request("**/v1/maps:import"):
        page.set_input_files("#files", [tmp_path / "a.csv"])
    page.get_by_label("Example").select_option(label="A flat")
    verdict(page, "usable")
    with page.expect_response("**/v1/maps:import"):
        waiting[0].continue_()
    expect(page.locator("#reading")).to_be_empty()
    expect(page.get_by_label("Example")).to_have_value("flat")


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A grid, and the bag of a short drive in it."""
    folder, rng = tmp_path_factory.mktemp("sample"), np.random.default_rng(11)
    floor = offices(rng, OfficePlan(rooms=4, corridors=1))
    way = way_through(floor)
    write_grid(folder, floor.segments, way[0])
    write_drive(folder / "drive.mcap", with_furniture(floor, rng), way[:24:2], rng)
    return folder


def test_a_bag_is_opened_and_its_scans_are_searched(page: Page, sample: Path) -> None:
    """The map is opened later, while the bag is being read."""
    shown(page, "rooms", "ambiguous")
    page.set_input_files("#files", [sample / "drive.mcap"])
    page.set_input_files("#files", [sample / "hq.yaml", sample / "hq.pgm"])
    expect(page.locator("#origin")).to_have_text("12 scans of drive.mcap", timeout=60_000)
    expect(page.locator("#about")).to_contain_text("(map_server)", timeout=60_000)
    told = page.locator("#scan-of-log")
    expect(told).to_contain_text(re.compile("Scan 1 of 12: (ok|ambiguous)"), timeout=30_000)
    page.get_by_role("button", name="Play").click()
    expect(told).to_contain_text(re.compile("Scan 12 of 12: (ok|ambiguous)"), timeout=60_000)
    expect(page.get_by_role("button", name="Play")).to_be_enabled()
    (usable,) = re.findall(r"\((\d+) of 12 are usable", told.inner_text())
    first = ["all scans (12)", f"usable ({usable})", f"not usable ({12 - int(usable)})"]
    assert page.locator("#filter option").all_inner_texts()[:3] == first
    expect(page.locator("#numbers")).to_contain_text("correspondences")
    expect(page.locator("#legend")).to_contain_text("usable")


@pytest.mark.long
def test_a_broken_bag_is_named(page: Page, tmp_path: Path) -> None:
    (tmp_path / "drive.bag").write_bytes(b"no bag")
    shown(page, "rooms", "ambiguous")
    page.set_input_files("#files", [tmp_path / "drive.bag"])
    expect(page.locator("#reading")).to_contain_text(re.compile("^drive.bag: "), timeout=60_000)
    verdict(page, "ambiguous")


def test_a_map_with_points_is_opened_as_a_map(page: Page, tmp_path: Path) -> None:
    """A scan of points has no segments, a map has them; both are searched together."""
    (tmp_path / "rooms.json").write_text(json.dumps(MAP))
    (tmp_path / "seen.json").write_text(json.dumps(SCAN))
    page.goto("/")
    verdict(page, "ambiguous")
    page.set_input_files("#files", [tmp_path / "rooms.json"])
    expect(page.locator("#about")).to_contain_text("A map from a file.")
    with page.expect_request("**/v1/associate") as asked:
        page.set_input_files("#files", [tmp_path / "seen.json"])
    assert asked.value.post_data_json["map"]["points"] == MAP["points"]
    verdict(page, "usable")
