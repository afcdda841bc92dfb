"""Every public name is there and states what it is."""

from __future__ import annotations

import inspect
from dataclasses import FrozenInstanceError, fields, is_dataclass
from typing import Any

import pytest

import registration
from registration.values import value


@pytest.mark.parametrize("name", registration.__all__)
def test_exported_members_are_documented(name: str) -> None:
    member = getattr(registration, name)
    assert member.__module__.startswith("registration.")
    # A dataclass without a docstring is given its signature for one.
    described = inspect.getdoc(member)
    assert described
    assert not described.startswith(f"{name}(")
    if inspect.isclass(member):
        for attribute, value in vars(member).items():
            if not attribute.startswith("_") and (inspect.isroutine(value) or isinstance(value, property)):
                assert inspect.getdoc(value), attribute


def test_exports_are_sorted_and_complete() -> None:
    assert registration.__all__ == sorted(registration.__all__, key=lambda name: (not name.isupper(), name))
    public = {
        name for name, member in vars(registration).items() if not name.startswith("_") and not inspect.ismodule(member)
    }
    assert public == set(registration.__all__)


@pytest.mark.parametrize("name", [name for name in registration.__all__ if is_dataclass(getattr(registration, name))])
def test_assigning_to_a_value_fails(name: str) -> None:
    member = getattr(registration, name)
    kind: Any = member if inspect.isclass(member) else type(member)
    value = object.__new__(kind)
    with pytest.raises(FrozenInstanceError):
        setattr(value, fields(kind)[0].name, 1.0)


def test_a_sequence_of_values_cannot_be_changed_either() -> None:
    """The former decorator of values still makes them frozen."""

    @value(frozen=True, slots=True)
    class Place:
        x: float

    places = (Place(1.0),)
    with pytest.raises(FrozenInstanceError):
        places[0].x = 99.0  # type: ignore[misc]
    assert places == (Place(1.0),)
