"""Values compare and hash by what is in them, as frozen dataclasses do."""

from __future__ import annotations

from dataclasses import fields, replace

import pytest

from registration.values import value


@value(frozen=True, slots=True)
class Place:
    x: float
    y: float = 0.0


@value(frozen=True, slots=True, eq=False)
class Thing:
    x: float


def test_values_are_what_they_hold() -> None:
    assert Place(1.0) == Place(1.0, 0.0) != Place(1.0, 2.0)
    assert len({Place(1.0), Place(1.0), Place(2.0)}) == 2
    assert replace(Place(1.0), y=3.0) == Place(1.0, 3.0)
    assert [one.name for one in fields(Place)] == ["x", "y"]
    with pytest.raises(AttributeError):
        Place(1.0).z = 2.0  # type: ignore[attr-defined]


def test_without_eq_they_are_themselves_alone() -> None:
    assert Thing(1.0) != Thing(1.0)
    assert len({Thing(1.0), Thing(1.0)}) == 2
