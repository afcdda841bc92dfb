"""Drawings of walls by their centre lines: that they are, how thick the walls are, and what is stated of it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from ezdxf import units
from ezdxf.filemanagement import new

from formats import ImportedMap, ImportOptions, read_map

# A house of three rooms: its outline, a wall across with a door in it, and one from the outline to that.
OUTLINE = [[0, 0, 8, 0], [8, 0, 8, 6], [8, 6, 0, 6], [0, 6, 0, 0]]
INNER = [[0, 3, 3, 3], [4, 3, 8, 3], [5, 3, 5, 6]]
HOUSE = [*OUTLINE, *INNER]


Lines = Sequence[Sequence[float]]


def csv(tmp_path: Path, lines: Lines) -> Path:
    path = tmp_path / "plan.csv"
    path.write_text("".join(",".join(map(str, line)) + "\n" for line in lines))
    return path


def assumed(imported: ImportedMap) -> dict[str, str]:
    return {note.code: note.message for note in imported.report.assumed}


def thickness(imported: ImportedMap, lines: Lines = HOUSE) -> list[float]:
    """Return how far the two faces of each wall are apart near its begin, metres; free space is on their left."""
    faces, found = imported.map.segments, []
    for x1, y1, x2, y2 in lines:
        at = np.array([x1 + 0.15 * (x2 - x1), y1 + 0.15 * (y2 - y1)])
        normal = np.array([y1 - y2, x2 - x1]) / np.hypot(x2 - x1, y2 - y1)
        along = np.einsum("ij,ij->i", at - faces.endpoints[:, :2], faces.directions)
        beside = (along > 0.0) & (along < faces.lengths)
        off = (faces.midpoints - at) @ normal
        facing = faces.normals @ normal
        near = np.abs(off) < 0.5
        found.append(min(off[beside & near & (facing > 0.9)]) - max(off[beside & near & (facing < -0.9)]))
    return [round(float(value), 6) for value in found]


def test_lines_that_meet_in_the_middle_of_others_are_centre_lines(tmp_path: Path) -> None:
    imported = read_map(csv(tmp_path, HOUSE))
    assert imported.map.oriented
    assert thickness(imported) == [0.2] * len(HOUSE)
    assert list(assumed(imported)) == ["centres", "thickness_usual"]
    assert "0.2 m thick" in assumed(imported)["thickness_usual"]
    assert "drawn to faces" in assumed(imported)["centres"]
    # Outside four faces, four in a room, in the two that the door parts five, and two ends at the door.
    assert len(imported.map.segments) == 4 + 4 + 2 * 5 + 2
    corners = {tuple(point) for point in imported.map.segments.endpoints.round(4).reshape(-1, 2).tolist()}
    assert len(corners) == len(imported.map.segments)  # each ends where another begins
    assert imported.map.meta == {"source": "plan.csv", "thickness": "0.2"}


@pytest.mark.parametrize(
    "lines",
    [
        OUTLINE,
        [*OUTLINE, *[[x + 20 for x in line] for line in OUTLINE]],
        # Two rooms, each with an outline of its own, and the wall between them.
        [[0, 0, 4, 0], [4, 0, 4, 6], [4, 6, 0, 6], [0, 6, 0, 0], [4.2, 0, 8, 0], [8, 0, 8, 6], [8, 6, 4.2, 6],
         [4.2, 6, 4.2, 0]],
        # The faces of a wall that end in the middle of another, as a careless drawing has them.
        [*OUTLINE, [0, 2.9, 8, 2.9], [0, 3.1, 8, 3.1]],
    ],
    ids=["an outline", "two outlines", "two rooms", "faces that end in a T"],
)  # fmt: skip
def test_faces_are_not_taken_for_centre_lines(tmp_path: Path, lines: Lines) -> None:
    imported = read_map(csv(tmp_path, lines))
    assert list(assumed(imported)) == ["directions"]
    assert len(imported.map.segments) == len(lines)


@pytest.mark.parametrize(
    "said",
    [
        ImportOptions(drawn="faces"),
        ImportOptions(directions="none"),
        ImportOptions(directions="drawn"),
        ImportOptions(inside=((1.0, 1.0),)),
    ],
    ids=["faces", "none", "drawn", "inside"],
)
def test_what_the_caller_says_goes_first(tmp_path: Path, said: ImportOptions) -> None:
    assert "centres" not in assumed(read_map(csv(tmp_path, HOUSE), said))


def test_walls_that_go_on_straight_are_drawn_once(tmp_path: Path) -> None:
    """An outer wall in two pieces, where an inner one meets it."""
    pieces = [[0, 0, 5, 0], [5, 0, 8, 0], *OUTLINE[1:], [5, 0, 5, 6], [5, 3, 8, 3]]
    faces = read_map(csv(tmp_path, pieces)).map.segments
    lower = [sorted((begin, end)) for begin, y, end, other in faces.endpoints.round(4) if y == other == -0.1]
    assert sorted(lower) == [[-0.1, 5.0], [5.0, 8.1]]


def test_a_map_of_our_own_stays_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "own.json"
    path.write_text(json.dumps({"segments": HOUSE, "oriented": False}))
    imported = read_map(path)
    assert (len(imported.map.segments), imported.map.oriented) == (len(HOUSE), False)


def test_a_thickness_that_is_given(tmp_path: Path) -> None:
    imported = read_map(csv(tmp_path, HOUSE), ImportOptions(thickness=0.3))
    assert thickness(imported) == [0.3] * len(HOUSE)
    assert list(assumed(imported)) == ["centres", "thickness_given"]


def test_widths_of_polylines_old_and_new(tmp_path: Path) -> None:
    document = new(units=units.CM)
    space = document.modelspace()
    space.add_lwpolyline([(0, 0), (800, 0), (800, 600), (0, 600)], close=True, dxfattribs={"const_width": 36})
    space.add_lwpolyline([(0, 300, 12, 12), (800, 300, 12, 12)])
    space.add_polyline2d([(500, 300), (500, 600)], dxfattribs={"default_start_width": 10, "default_end_width": 10})
    document.saveas(tmp_path / "plan.dxf")
    imported = read_map(tmp_path / "plan.dxf")
    assert thickness(imported, [*OUTLINE, [0, 3, 8, 3], [5, 3, 5, 6]]) == [0.36] * 4 + [0.12, 0.1]
    assert list(assumed(imported)) == ["centres", "thickness_drawn"]


def test_lines_of_an_svg_as_wide_as_walls(tmp_path: Path) -> None:
    body = "".join(f'<line x1="{a}" y1="{b}" x2="{c}" y2="{d}"/>' for a, b, c, d in OUTLINE)
    x1, y1, x2, y2 = INNER[0]
    inner = f'<line style="fill:none;stroke-width:0.3px" x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}"/>'
    rest = "".join(f'<line stroke-width="5%" x1="{a}" y1="{b}" x2="{c}" y2="{d}"/>' for a, b, c, d in INNER[1:])
    path = tmp_path / "plan.svg"
    path.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg"><g transform="scale(100)">'
        f'<g stroke-width="0.4">{body}</g>{inner}{rest}</g></svg>'
    )
    imported = read_map(path, ImportOptions(units="cm"))
    upright = [[x1, -y1, x2, -y2] for x1, y1, x2, y2 in HOUSE]
    assert thickness(imported, upright) == [0.4] * 4 + [0.3, 0.4, 0.4]  # those without a number get the median
    assert "2 lines without a width" in assumed(imported)["thickness_drawn"]


@pytest.mark.parametrize("pen", [0.001, 3.0])
def test_a_pen_is_no_wall(tmp_path: Path, pen: float) -> None:
    body = "".join(f'<line x1="{a}" y1="{b}" x2="{c}" y2="{d}"/>' for a, b, c, d in HOUSE)
    path = tmp_path / "plan.svg"
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" stroke-width="{pen}">{body}</svg>')
    assert list(assumed(read_map(path, ImportOptions(units="m")))) == ["centres", "thickness_usual"]


def test_the_thickness_that_a_geojson_has(tmp_path: Path) -> None:
    def feature(line: Sequence[float], told: dict[str, object]) -> dict[str, object]:
        return {
            "type": "Feature",
            "properties": told,
            "geometry": {"type": "LineString", "coordinates": [line[:2], line[2:]]},
        }

    features = [feature(line, {"thickness": 0.24}) for line in OUTLINE]
    features += [feature(line, {"width": 0.1, "thickness": "thin"}) for line in INNER]
    path = tmp_path / "plan.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    assert thickness(read_map(path, ImportOptions(local_metres=True))) == [0.24] * 4 + [0.1] * 3
