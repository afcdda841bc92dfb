"""A map checked in one call, and its answer as a document of the API."""

from __future__ import annotations

import time

import numpy as np
import pytest

import linefix
from linefix.documents.results import checked_json
from simulation import Scanner, scan

ROOM = [[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]]
FIELDS = {"findings", "size", "advice", "places", "viewpoints", "complete", "samples"}


def seen(scale: float) -> list[linefix.Scan]:
    """Return scans of the room, as of a map whose lengths are divided by `scale`."""
    walls = linefix.Segments.from_array(scale * np.array(ROOM, dtype=float))
    scanner = Scanner(beams=360, angle_increment=2.0 * np.pi / 360, sigma=0.01)
    poses = [linefix.RigidTransform(scale * x, scale * 1.2, x) for x in (1.0, 2.0, 3.0)]
    ranges = [scan(walls, pose, scanner, np.random.default_rng(k)).ranges for k, pose in enumerate(poses)]
    return [linefix.scan_of(one, (scanner.angle_min, scanner.angle_increment)) for one in ranges]


def test_a_map_alone_has_no_samples() -> None:
    found = linefix.check(linefix.index_map(ROOM))
    assert (found.report, found.samples, found.complete) == (None, (), True)
    document = checked_json(found)
    assert document["samples"] is None
    assert set(document) == FIELDS


@pytest.mark.parametrize(("scale", "codes"), [(1.0, []), (1.5, ["scale"])])
def test_scans_come_first(scale: float, codes: list[str]) -> None:
    found = linefix.check(linefix.index_map(ROOM), seen(scale))
    assert [one.code for one in found.all.findings if one.code != "looks_alike"] == codes
    document = checked_json(found)
    assert [one["code"] for one in document["findings"]][: len(codes)] == codes
    assert len(document["samples"]["scans"]) == 3


def test_samples_without_time_are_none() -> None:
    found = linefix.check(linefix.index_map(ROOM), seen(1.0), deadline=linefix.Deadline(time.monotonic()))
    assert found.samples == (None, None, None)
    assert not found.complete
    assert [one["status"] for one in checked_json(found)["samples"]["scans"]] == [None] * 3
