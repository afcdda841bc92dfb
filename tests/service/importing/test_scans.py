"""Which scans of a log are read, and where a reduced picture of a grid lies."""

from __future__ import annotations

import base64
import io
import math

import numpy as np
import pytest
from PIL import Image

from formats import GridPicture
from registration import RigidTransform
from service.importing.reader import MOST_PIXELS, picture_json


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
