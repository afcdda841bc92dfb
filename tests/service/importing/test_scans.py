"""Which scans of a log are read, and where a reduced picture of a grid lies."""

from __future__ import annotations

import base64
import io
import math
from typing import Any

import numpy as np
import pytest
from PIL import Image

from formats import GridPicture
from registration import RigidTransform
from service.importing.reader import MOST_PIXELS, picture_json, spread


@pytest.mark.parametrize("most", [1, 2, 3, 7, 100])
@pytest.mark.parametrize("count", [0, 1, 2, 3, 8, 9, 50])
def test_scans_are_spread_evenly(count: int, most: int) -> None:
    scans: Any = iter(range(count))
    kept, counted = spread(scans, most)
    assert counted == count
    assert min(count, (most + 1) // 2) <= len(kept) <= most
    steps = set(np.diff(kept).tolist())  # type: ignore[arg-type]
    assert len(steps) <= 1
    if count:
        assert kept[0] == 0  # type: ignore[comparison-overlap]


def test_a_large_picture_is_reduced_and_stays_in_its_place() -> None:
    """A mark in the highest row, whose place does not change by more than a pixel."""
    rows, columns = 2 * MOST_PIXELS + 1, 30
    pixels = np.full((rows, columns), 255, np.uint8)
    pixels[:3] = 0
    pose = RigidTransform(4.0, -3.0, 0.5)
    found = picture_json(GridPicture(pixels, pose, 0.1))
    image = np.asarray(Image.open(io.BytesIO(base64.b64decode(found["png"]))))
    assert max(image.shape) <= MOST_PIXELS
    assert image[0, 0] == 0
    assert found["resolution"] == pytest.approx(0.3)
    height = image.shape[0] * found["resolution"]
    top = RigidTransform(**found["pose"]).apply(np.array([[0.0, height]]))
    assert top == pytest.approx(pose.apply(np.array([[0.0, 0.1 * rows]])), abs=1e-9)
    assert found["pose"]["theta"] == 0.5
    assert math.isfinite(found["pose"]["x"])
