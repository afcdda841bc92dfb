"""Every public name is there and states what it is."""

from __future__ import annotations

import inspect

import pytest

import registration


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
