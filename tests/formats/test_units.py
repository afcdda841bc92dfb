"""A drawing whose unit is wrong: the report says how large it is, and which unit is likelier."""

from __future__ import annotations

from pathlib import Path

import pytest
from ezdxf.filemanagement import new

from formats import ImportOptions, IncompleteFileError, MalformedFileError, read_map

PLAN = [(0, 0, 8, 0), (8, 0, 8, 5), (8, 5, 3.5, 5), (2.6, 5, 0, 5), (0, 5, 0, 0), (4, 0, 4, 2), (4, 2.9, 4, 5)]
US_FOOT = 1200 / 3937
IN_METRES = {  # of $INSUNITS
    1: 0.0254, 2: 0.3048, 4: 0.001, 5: 0.01, 6: 1.0, 8: 2.54e-8, 9: 2.54e-5, 10: 0.9144, 21: US_FOOT,
    22: US_FOOT / 12, 23: 3 * US_FOOT, 24: 5280 * US_FOOT,
}  # fmt: skip


def noted(tmp_path: Path, units: int, drawn_in: float, options: ImportOptions | None = None) -> dict[str, str]:
    document = new()
    document.header["$INSUNITS"] = units
    for line in PLAN:
        x1, y1, x2, y2 = (c / drawn_in for c in line)
        document.modelspace().add_line((x1, y1), (x2, y2))
    document.saveas(tmp_path / "plan.dxf")
    report = read_map(tmp_path / "plan.dxf", options or ImportOptions()).report
    return {note.code: note.message for note in (*report.read, *report.assumed)}


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
    assert noted(tmp_path, units, US_FOOT, ImportOptions(units="us-ft"))["unit"].endswith("8 m by 5 m")


def test_a_drawing_of_millimetres_that_is_in_metres(tmp_path: Path) -> None:
    with pytest.raises(MalformedFileError, match=r"no line of 0.01 m: .* in m it is 5 m \(a factor of 1000\)"):
        noted(tmp_path, 4, 1.0)


def test_the_unit_that_the_caller_says(tmp_path: Path) -> None:
    found = noted(tmp_path, 1, 0.001, ImportOptions(units="mm"))
    assert "unlikely_unit" not in found
    assert found["unit"] == "1 unit is 0.001 m (mm), as the option states: the drawing is 8 m by 5 m"
