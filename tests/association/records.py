"""Comparison of records field by field."""

from __future__ import annotations

from typing import Any

import numpy as np

from registration.layout import Records

UPPER = ("xx", "xy", "xt", "yy", "yt", "tt")


def assert_records(got: Records, expected: Records, **tolerance: Any) -> None:
    """Compare records field by field."""
    assert got.dtype == expected.dtype
    for name in expected.dtype.names or ():
        np.testing.assert_allclose(got[name], expected[name], err_msg=name, **tolerance)
