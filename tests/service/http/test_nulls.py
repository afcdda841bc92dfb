"""Ranges that are null: unknown beams, or beams without a return that a JSON bridge could not write."""

from __future__ import annotations

from typing import Any

import httpx
import pytest

from .test_motion import found, laser
from .test_views import EXACT

CODE = "nulls_for_no_return"


def with_nulls(every: int, **more: Any) -> dict[str, Any]:
    """Return a scan of which one beam in `every` is null."""
    scan = laser(**more)
    scan["ranges"] = [None if k % every == 0 else r for k, r in enumerate(scan["ranges"])]
    return scan


def warned(answer: dict[str, Any]) -> list[str]:
    return [one["message"] for one in answer["warnings"] if one["code"] == CODE]


@pytest.mark.parametrize(
    "scan",
    [{"laser": with_nulls(2, range_max=30.0)}, {"views": [{"laser": with_nulls(2, range_max=30.0), "pose": EXACT}]}],
    ids=["one sensor", "views"],
)
def test_many_nulls_and_no_beam_without_a_return_are_warned_of(client: httpx.Client, scan: dict[str, Any]) -> None:
    """Infinity cannot be written as JSON; a bridge that writes null loses the free space as evidence."""
    (message,) = warned(found(client, scan))
    assert message.startswith("360 of 720 ranges are null, and none exceeds range_max.")


def test_few_nulls_are_usual(client: httpx.Client) -> None:
    assert warned(found(client, {"laser": with_nulls(4, range_max=30.0)})) == []


def test_a_bridge_that_writes_beams_without_a_return_writes_all_of_them(client: httpx.Client) -> None:
    scan = with_nulls(2, range_max=30.0)
    scan["ranges"][1] = 31.0
    assert warned(found(client, {"laser": scan})) == []
