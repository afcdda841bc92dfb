"""Each part of the score can be taken out, and comes back."""

from __future__ import annotations

import numpy as np
import pytest

from association import MapIndex, Scan, associate
from benchmarks.parts import VARIANTS
from registration import MeasuredSegments, Segments

ROOM = np.array([[0, 0, 8, 0], [8, 0, 8, 3], [8, 3, 5, 3], [5, 3, 5, 6], [5, 6, 0, 6], [0, 6, 0, 0]], dtype=float)
# Of the first wall two pieces, 3 cm apart from one another and from the map.
SEEN = np.array([[-3, -1.03, 0, -1.03], [0.5, -1.0, 5, -1.0], [5, -1, 5, 2], [5, 2, 2, 2]], dtype=float)


def score() -> float:
    scan = Scan(MeasuredSegments.from_segments(Segments.from_array(np.vstack([SEEN, SEEN[:1]])), 0.02))
    result = associate(MapIndex.build(Segments.from_array(ROOM), 0.02), scan)
    assert result.diagnostics is not None
    return result.diagnostics.score


@pytest.mark.parametrize("name", list(VARIANTS)[1:])
def test_without_a_part_the_score_is_another(name: str) -> None:
    whole = score()
    with VARIANTS[name]():
        other = score()
    assert abs(other - whole) > 0.1
    assert score() == whole
    if name == "no segments joined":
        assert other - whole > 5.0  # what was sent twice counts twice
