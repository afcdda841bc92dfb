"""The thresholds of the ``tuning.py`` of a package, and how to move one of them in all modules that read it."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import association

ROOT = Path(association.__file__).parents[1]

Number = int | float
Value = Number | tuple[Number, ...]


@dataclass(frozen=True, slots=True)
class Threshold:
    """A constant of a ``tuning.py``.

    Attributes
    ----------
    module : str
        Name of the `tuning` module.
    name : str
    value : number or tuple of numbers
    compiled : bool
        True if a kernel reads it.
    """

    module: str
    name: str
    value: Value
    compiled: bool

    def moved(self, factor: float) -> Value:
        """Return the value times a factor; an integer moves by one at least."""
        if isinstance(self.value, tuple):
            return tuple(_moved(one, factor) for one in self.value)
        return _moved(self.value, factor)


def _moved(value: Number, factor: float) -> Number:
    if isinstance(value, float):
        return value * factor
    moved = round(value * factor)
    return moved if moved != value else value + (1 if factor > 1.0 else -1)


def thresholds(package: str = "association") -> list[Threshold]:
    """Return all numbers of the ``tuning.py`` of a package but derived ones, in the order of the files."""
    found = []
    for path in sorted(ROOT.joinpath(*package.split(".")).rglob("tuning.py")):
        name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        module = sys.modules.get(name) or __import__(name, fromlist=["*"])
        derived = _derived(path)
        for constant in _assigned(path):
            value = getattr(module, constant)
            if constant in derived:
                continue
            if _is_number(value) or (isinstance(value, tuple) and all(map(_is_number, value))):
                found.append(Threshold(name, constant, value, _is_compiled(constant)))
    return found


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _assigned(path: Path) -> Iterator[str]:
    """Yield the names that a module assigns, in their order."""
    for statement in ast.parse(path.read_text()).body:
        if isinstance(statement, ast.Assign):
            for target in statement.targets:
                yield from (node.id for node in ast.walk(target) if isinstance(node, ast.Name))


def _derived(path: Path) -> dict[str, ast.expr]:
    """Return the constants that are computed from one other alone, such as a cosine of an angle."""
    found = {}
    for statement in ast.parse(path.read_text()).body:
        if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name):
            names = [node.id for node in ast.walk(statement.value) if isinstance(node, ast.Name)]
            if any(name.isupper() for name in names) and not isinstance(statement.value, ast.Tuple):
                found[statement.targets[0].id] = statement.value
    return found


def _is_compiled(name: str) -> bool:
    return any("kernels" in module.__name__.split(".") for module in readers(name))


def readers(name: str) -> list[ModuleType]:
    """Return the loaded modules of the project that have a threshold among their names."""
    packages = ("association.", "map_quality.", "linefix.", "benchmarks.")
    return [
        module
        for key, module in sorted(sys.modules.items())
        if key.startswith(packages) and name in vars(module) and not key.endswith(".tuning")
    ]


def is_of_index(threshold: Threshold) -> bool:
    """Return whether the index of a map depends on a threshold."""
    return any(module.__name__.startswith("association.index.") for module in readers(threshold.name))


class moved:  # noqa: N801
    """Let all modules see another value of a threshold, for as long as the block lasts."""

    def __init__(self, threshold: Threshold, value: Value) -> None:
        self._tuning, self._name = sys.modules[threshold.module], threshold.name
        self._value, self._before = value, getattr(self._tuning, threshold.name)

    def __enter__(self) -> None:
        self._set(self._value)

    def __exit__(self, *_: object) -> None:
        self._set(self._before)

    def _set(self, value: Value) -> None:
        """Set the threshold and what is derived from it, and forget what functions have cached."""
        values: dict[str, Any] = {self._name: value}
        setattr(self._tuning, self._name, value)
        for name, expression in _derived(Path(str(self._tuning.__file__))).items():
            if self._name in {node.id for node in ast.walk(expression) if isinstance(node, ast.Name)}:
                values[name] = eval(ast.unparse(expression), vars(self._tuning))  # of our own module
                setattr(self._tuning, name, values[name])
        for name, one in values.items():
            for module in readers(name):
                setattr(module, name, one)
        for key, module in list(sys.modules.items()):
            if key.startswith("association."):
                for member in list(vars(module).values()):
                    if hasattr(member, "cache_clear"):
                        member.cache_clear()
