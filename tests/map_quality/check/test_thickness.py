"""Scans reveal the thickness of walls, however they were drawn."""

from __future__ import annotations

import time

import numpy as np
import pytest

from association import Deadline, Scan
from map_quality import conclude, find_thickness, try_sample
from map_quality.check.thickness import thickness_finding
from registration import MeasuredSegments, Segments
from registration.layout import Floats

from .drawn import THICK, centre_lines, faces, index_of, reversed_ends, sampled, two_faces

MIRROR = np.array([1.0, -1.0, 1.0, -1.0])


def found(walls: Floats, *, oriented: bool = True, deadline: Deadline | None = None) -> float | None:
    scans = [scan for _, scan in sampled()]
    return find_thickness(index_of(walls), scans, deadline or Deadline(), oriented=oriented)


def test_of_centre_lines() -> None:
    assert found(centre_lines(), oriented=False) == pytest.approx(THICK, abs=0.02)


@pytest.mark.parametrize("drawn", [0.04, 0.1, 0.35])
def test_of_walls_too_thick_or_too_thin(drawn: float) -> None:
    assert found(two_faces(drawn)) == pytest.approx(THICK - drawn, abs=0.02)


def test_nothing_where_walls_are_right() -> None:
    assert found(faces()) is None
    assert found(two_faces(THICK)) is None


@pytest.mark.parametrize(
    ("walls", "code"), [(reversed_ends(faces() * MIRROR), "mirrored"), (two_faces(0.4), "thickness")]
)
def test_which_of_the_two_it_is(walls: Floats, code: str) -> None:
    """A mirrored map fits badly whatever its walls are; one that is too thick fits badly mirrored, too."""
    index, scans = index_of(walls), [scan for _, scan in sampled()]
    samples = [try_sample(index, scan, Deadline(), oriented=True) for scan in scans]
    report = conclude(index, scans, samples, Deadline(), oriented=True)
    assert [one.code for one in report.findings] == [code]


def test_nothing_by_scans_that_see_nothing() -> None:
    blind = Scan(MeasuredSegments.from_segments(Segments.from_array([])))
    assert find_thickness(index_of(faces()), [blind], Deadline(), oriented=True) is None


def test_nothing_without_scans_and_without_time() -> None:
    assert find_thickness(index_of(faces()), [], Deadline(), oriented=True) is None
    assert found(centre_lines(), oriented=False, deadline=Deadline(time.monotonic())) is None


def test_the_sentence_says_what_to_do() -> None:
    centres = thickness_finding(0.284, oriented=False)
    assert (centres.code, "thickness 0.28" in centres.message) == ("centre_lines", True)
    thin, thick = thickness_finding(0.08, oriented=True), thickness_finding(-0.08, oriented=True)
    assert thin.code == thick.code == "thickness"
    assert "8 cm thicker than drawn" in thin.message
    assert "8 cm thinner than drawn" in thick.message
    assert "thickness plus 0.08 m" in thin.message
    assert "thickness minus 0.08 m" in thick.message
    assert all("any other map, for example a grid" in one.message for one in (thin, thick))  # which has no thickness
