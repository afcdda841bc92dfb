"""A drawing of centre lines, as it is: scans of the building are found in it, and nothing has to be said."""

from __future__ import annotations

import math
from pathlib import Path

import linefix
from formats import ImportedMap, ImportOptions
from tests.association.scenes import known
from tests.map_quality.check.drawn import centre_lines, sampled

SCANS = 12


def usable(map: ImportedMap) -> int:
    """Count the usable answers; all of them are right."""
    index, count = linefix.index_map(map), 0
    for truth, scan in sampled(SCANS):
        answer = linefix.locate(index, scan)
        if answer.usable:
            assert math.hypot(known(answer.pose).x - truth.x, known(answer.pose).y - truth.y) < 0.1
            count += 1
    return count


def test_scans_are_usable_without_a_word(tmp_path: Path) -> None:
    path = tmp_path / "plan.csv"
    path.write_text("".join(",".join(map(str, line)) + "\n" for line in centre_lines().tolist()))
    assert usable(linefix.read_map(path, ImportOptions(drawn="faces"))) <= 1
    assert usable(linefix.read_map(path)) >= 4  # with the true faces, and with doors as they are, 8
