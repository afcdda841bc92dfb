"""Kinds of DXF and of what is in one: binary files, multilines, and messages that name what is not read."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest
from ezdxf import units
from ezdxf.document import Drawing as Document
from ezdxf.filemanagement import new
from ezdxf.xclip import XClip

from formats import ImportedMap, ImportOptions, IncompleteFileError, MalformedFileError, TooLargeError, read_map

from .reading import notes, saved, written

ROOM = [(0.0, 0.0), (7.0, 0.0), (7.0, 4.0), (3.0, 4.0), (3.0, 6.0), (0.0, 6.0)]


def drawn(*, to: tuple[float, float] = (0.0, 0.0)) -> Document:
    document = new(units=units.M)
    document.modelspace().add_lwpolyline([(x + to[0], y + to[1]) for x, y in ROOM], close=True)
    return document


def read(tmp_path: Path, document: Document) -> ImportedMap:
    return read_map(saved(tmp_path, document), ImportOptions(drawn="faces"))


@pytest.mark.parametrize("version", ["R12", "R2000", "R2007", "R2018"])
def test_binary_files(tmp_path: Path, version: str) -> None:
    document = new(version, units=units.MM)
    block = document.blocks.new("WING")
    block.add_line((0, 0), (3000, 0))
    document.modelspace().add_blockref("WING", (0, 1000))
    document.modelspace().add_arc((0, 0), 2000, 0, 90)
    text, binary = (
        read_map(saved(tmp_path, document, fmt), ImportOptions(units="mm")).map.segments.endpoints
        for fmt in ("asc", "bin")
    )
    assert len(text) > 5
    assert (text == binary).all()


@pytest.mark.parametrize("kept", [23, 300, 5_000])
def test_binary_files_that_are_cut_off(tmp_path: Path, kept: int) -> None:
    path = saved(tmp_path, drawn(), "bin")
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(MalformedFileError, match=r"is not a DXF|has no lines"):
        read_map(path, ImportOptions(units="m"))


@pytest.mark.parametrize("size", [1e10, 1e15, 1e300])
@pytest.mark.parametrize("kind", ["CIRCLE", "SPLINE", "block"])
def test_a_curve_too_large_to_be_drawn_is_refused(tmp_path: Path, kind: str, size: float) -> None:
    document = drawn()
    block = document.blocks.new("WING")
    block.add_circle((0, 0), 1.0)
    if kind == "CIRCLE":
        document.modelspace().add_circle((0, 0), size)
    elif kind == "SPLINE":
        document.modelspace().add_open_spline([(0, 0), (size, 1), (5, size), (3, 3)])
    else:
        document.modelspace().add_blockref("WING", (0, 0), {"xscale": size, "yscale": size})
    named = "CIRCLE" if kind == "block" else kind
    with pytest.raises(TooLargeError, match=rf"plan.dxf: has coordinates beyond 1e\+09 m: {named} on layer 0, handle"):
        read(tmp_path, document)


def test_multilines(tmp_path: Path) -> None:
    """Both faces of a wall 0.3 m thick, at corners too, with its ends closed; in a block as well."""
    document = new(units=units.M)
    style = document.mline_styles.new("WALL")
    style.elements.append(0.15)
    style.elements.append(-0.15)
    document.modelspace().add_mline([(0, 0), (5, 0), (5, 4)], dxfattribs={"style_name": "WALL"})
    block = document.blocks.new("PLAN")
    block.add_mline([(0, 0), (2, 0)], dxfattribs={"style_name": "WALL"})
    document.modelspace().add_blockref("PLAN", (10, 10), dxfattribs={"rotation": 90})
    found = read(tmp_path, document)
    lengths = sorted(found.map.segments.lengths.round(3).tolist())
    assert lengths == [2.0, 2.0, 4.0, 4.3, 5.0, 5.3]  # its upper element runs through the points
    assert notes(found)["entity_mline"].count == 2


def test_a_closed_multiline_on_a_frozen_layer(tmp_path: Path) -> None:
    document = drawn()
    document.layers.add("OLD").freeze()
    document.modelspace().add_mline(ROOM, close=True, dxfattribs={"layer": "OLD"})
    found = read(tmp_path, document)
    assert len(found.map.segments) == 6
    note = notes(found)["hidden_layer"]
    assert (note.message, note.count) == ("entities and blocks on layers that are off or frozen: OLD", 1)


def refused(tmp_path: Path, document: Document) -> str:
    with pytest.raises(MalformedFileError, match="has no lines that could be walls") as caught:
        read(tmp_path, document)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_walls_in_paper_space(tmp_path: Path) -> None:
    document = new(units=units.M)
    sheet = document.layout("Layout1")
    for a, b in pairwise(ROOM):
        sheet.add_line(a, b)
    sheet.add_text("Hall")
    message = refused(tmp_path, document)
    assert "entities in paper space, layout Layout1; move walls to the model space (CHSPACE) (6)" in message


def test_an_external_reference(tmp_path: Path) -> None:
    document = new(units=units.M)
    document.add_xref_def("C:\\plans\\ground floor.dwg", "GROUND")
    document.modelspace().add_blockref("GROUND", (12, -3))
    message = refused(tmp_path, document)
    assert "GROUND (C:\\plans\\ground floor.dwg) at (12, -3)" in message
    assert "bind" in message


def test_other_contents_are_named_with_their_counts(tmp_path: Path) -> None:
    document = new(units=units.M)
    document.modelspace().add_text("Hall")
    document.modelspace().add_text("Lift")
    document.modelspace().add_point((1, 1))
    document.modelspace().add_blockref("NOWHERE", (1, 1))
    document.modelspace().add_polyface().append_face([(0, 0, 0), (1, 0, 0), (1, 1, 0)])
    message = refused(tmp_path, document)
    for part in ("TEXT is not read (2)", "POINT is not read (1)", "POLYLINE of a mesh is not read (1)"):
        assert part in message


def test_objects_of_other_programs(tmp_path: Path) -> None:
    path, proxy = (
        saved(tmp_path, new(units=units.M)),
        "  0\nACAD_PROXY_ENTITY\n  5\nFF{}\n100\nAcDbEntity\n  8\nA-WALL\n",
    )
    head, section, tail = path.read_text().partition("ENTITIES\n")
    path.write_text(head + section + proxy.format(1) + proxy.format(2) + tail)
    with pytest.raises(MalformedFileError, match=r"ACAD_PROXY_ENTITY is not read: .*EXPORTTOAUTOCAD.* \(2\)"):
        read_map(path)


UTM = (350_000.0, 5_400_000.0)


@pytest.mark.parametrize(
    ("begin", "end", "code", "told"),
    [
        ((0.0, 0.0), (2.0, 0.0), "far_lines", "1 on SCRATCH at (1, 0) m"),
        ((450_000.0, 5_400_000.0), (450_002.0, 5_400_000.0), "far_lines", "1 on SCRATCH at (450001, 5.4e+06) m"),
        ((352_500.0, 5_400_000.0), (352_502.0, 5_400_000.0), "far_lines", "1 on SCRATCH at (352501, 5.4e+06) m"),
        ((0.0, 0.0), UTM, "long_lines", "1 on SCRATCH"),
    ],
)
def test_a_stray_line_is_left_out_and_named(
    tmp_path: Path, begin: tuple[float, float], end: tuple[float, float], code: str, told: str
) -> None:
    document = drawn(to=UTM)
    document.modelspace().add_line(begin, end, dxfattribs={"layer": "SCRATCH"})
    found = read(tmp_path, document)
    assert len(found.map.segments) == 6
    assert told in notes(found)[code].message
    assert notes(found)[code].count == 1


def test_two_buildings_too_far_apart_are_refused_by_name(tmp_path: Path) -> None:
    document = drawn()
    for k, (a, b) in enumerate(pairwise(ROOM)):
        document.modelspace().add_line(
            (a[0] + 3e5, a[1]), (b[0] + 3e5, b[1]), dxfattribs={"layer": "EAST" if k else "ANNEX"}
        )
    with pytest.raises(MalformedFileError, match=r"29999[0-9] m or more from the others: 5 on ANNEX, EAST") as caught:
        read(tmp_path, document)
    assert "6 on 0 around" in str(caught.value)


def test_buildings_of_one_site_stay_together(tmp_path: Path) -> None:
    document = drawn()
    for a, b in pairwise(ROOM):
        document.modelspace().add_line((a[0] + 600, a[1]), (b[0] + 600, b[1]))
    found = read(tmp_path, document)
    assert len(found.map.segments) == 11
    assert "594 m or more" in notes(found)["far_lines"].message


def test_many_tiny_entities_are_refused_before_they_are_parsed(tmp_path: Path) -> None:
    content = "  0\nSECTION\n  2\nENTITIES\n" + "0\nLINE\n" * 800_000 + "0\nENDSEC\n0\nEOF\n"
    with pytest.raises(TooLargeError, match="entities and objects"):
        read_map(written(tmp_path, "plan.dxf", content))


@pytest.mark.parametrize("nested", [False, True])
@pytest.mark.parametrize(
    ("clip", "inverted", "expected"),
    [
        ([(1, -1), (3, 1)], False, [(1, 0, 3, 0)]),
        ([(1, -1), (3, -1), (3, 1), (2, -0.5), (1, 1)], False, [(1, 0, 1.6667, 0), (2.3333, 0, 3, 0)]),
        ([(1, -1), (3, -1), (3, 1), (1, 1)], True, [(0, 0, 1, 0), (3, 0, 4, 0)]),
        (None, False, [(0, 0, 4, 0)]),
    ],
)
def test_what_a_clip_of_a_block_hides(
    tmp_path: Path,
    nested: bool,
    clip: list[tuple[float, float]] | None,
    inverted: bool,
    expected: list[tuple[float, ...]],
) -> None:
    document = new(units=units.M)
    document.blocks.new("PLAN").add_line((0, 0), (4, 0))
    document.blocks["PLAN"].add_line((0, 9), (4, 9))
    outer = document.blocks.new("OUTER") if nested else document.modelspace()
    reference = outer.add_blockref("PLAN", (10, 20))
    clipping = XClip(reference)
    if clip is not None:
        clipping.set_block_clipping_path(clip)
    if inverted:
        clipping.invert_clipping_path([(-1, -1), (5, 10)], ignore_acad_compatibility=True)
    if nested:
        document.modelspace().add_blockref("OUTER", (1, 1))
    x, y = (11, 21) if nested else (10, 20)
    found = read(tmp_path, document)
    low = [row for row in found.map.segments.endpoints.tolist() if row[1] < y + 5]
    assert sorted(low) == [pytest.approx((a + x, b + y, c + x, d + y), abs=1e-3) for a, b, c, d in expected]
    assert ("clipped" in notes(found)) == (clip is not None)


def test_the_control_frame_of_a_smoothed_polyline_is_no_wall(tmp_path: Path) -> None:
    document = new(units=units.M)
    curve = document.modelspace().add_polyline2d([(0, 0), (1, 0.5), (2, 0)], dxfattribs={"flags": 4})
    for vertex in curve.vertices:
        vertex.dxf.flags = 8
    curve.append_vertices([(0, 0), (1, 5), (2, 0)], dxfattribs={"flags": 16})
    assert read(tmp_path, document).map.segments.endpoints[:, [1, 3]].max() == 0.5


PLAN = [(0, 0, 8, 0), (8, 0, 8, 5), (8, 5, 3.5, 5), (2.6, 5, 0, 5), (0, 5, 0, 0), (4, 0, 4, 2), (4, 2.9, 4, 5)]
US_FT = 1200 / 3937
IN_METRES = {  # of $INSUNITS
    1: 0.0254, 2: 0.3048, 4: 0.001, 5: 0.01, 6: 1.0, 8: 2.54e-8, 9: 2.54e-5, 10: 0.9144, 21: US_FT,
    22: US_FT / 12, 23: 3 * US_FT, 24: 5280 * US_FT,
}  # fmt: skip


def noted(tmp_path: Path, units: int, drawn_in: float, options: ImportOptions | None = None) -> dict[str, str]:
    document = new()
    document.header["$INSUNITS"] = units
    for line in PLAN:
        x1, y1, x2, y2 = (c / drawn_in for c in line)
        document.modelspace().add_line((x1, y1), (x2, y2))
    found = read_map(saved(tmp_path, document), options or ImportOptions())
    return {code: note.message for code, note in notes(found).items()}


@pytest.mark.parametrize("units", IN_METRES)
def test_a_right_unit_is_not_doubted(tmp_path: Path, units: int) -> None:
    found = noted(tmp_path, units, IN_METRES[units])
    assert "unlikely_unit" not in found
    assert found["unit"].endswith("as the file states: the drawing is 8 m by 5 m")


@pytest.mark.parametrize(
    ("units", "drawn_in", "said"),
    [
        (1, 0.001, "in mm it is 5 m (a factor of 25.4)"),
        (4, 0.0254, "in in it is 5 m (a factor of 25.4)"),
        (6, 0.001, "in mm it is 5 m (a factor of 1000)"),
        (6, 0.01, "in cm it is 5 m (a factor of 100)"),
        (6, 0.0254, "in in it is 5 m (a factor of 39.3701)"),
        (2, 0.001, "in mm it is 5 m (a factor of 304.8)"),
        (5, 1.0, "in m it is 5 m (a factor of 100)"),
        (4, 0.01, "in cm it is 5 m (a factor of 10)"),
        (4, 0.3048, "in ft it is 5 m (a factor of 304.8)"),
    ],
)
def test_another_unit_is_named_with_its_factor(tmp_path: Path, units: int, drawn_in: float, said: str) -> None:
    found = noted(tmp_path, units, drawn_in)
    assert said in found["unlikely_unit"]
    assert "set the option units" in found["unlikely_unit"]


@pytest.mark.parametrize("units", [19, 25, 99])
def test_a_unit_that_no_building_has_is_none(tmp_path: Path, units: int) -> None:
    with pytest.raises(IncompleteFileError, match=f"INSUNITS is {units}, .*set the option units"):
        noted(tmp_path, units, 1.0)
    found = noted(tmp_path, units, US_FT, ImportOptions(units="us-ft"))
    assert "unlikely_unit" not in found
    assert found["unit"] == "1 unit is 0.304801 m (us-ft), as the option states: the drawing is 8 m by 5 m"


def test_a_drawing_of_millimetres_that_is_in_metres(tmp_path: Path) -> None:
    with pytest.raises(MalformedFileError, match=r"no line of 0.01 m: .* in m it is 5 m \(a factor of 1000\)"):
        noted(tmp_path, 4, 1.0)
