"""Rules of every kernel, tested in its source; kernels that are not compiled answer the same."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from compiled.kernels import interpreted
from registration import MeasuredSegments, Segments, register
from registration.layout import Records
from tests.registration.scenes import diagonal, pose_of

ROOT = Path(__file__).parents[2]
MODULES = sorted(path for path in ROOT.glob("*/kernels/**/*.py") if not path.parts[len(ROOT.parts)].startswith("."))
MOST_ARGUMENTS = 8


def functions(source: str) -> Iterator[ast.FunctionDef]:
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef) and any(
            isinstance(d, ast.Name) and d.id == "kernel" for d in node.decorator_list
        ):
            yield node


def elements_of(node: ast.AST) -> Iterator[str]:
    """Return the names of the arrays that elements are taken of, `a` for ``a[i]``, but not for ``a[i:j]``."""
    for inner in ast.walk(node):
        if isinstance(inner, ast.Subscript) and isinstance(inner.value, ast.Name):
            index = inner.slice.elts if isinstance(inner.slice, ast.Tuple) else [inner.slice]
            if not any(isinstance(part, ast.Slice) for part in index):
                yield inner.value.id


def whole_uses(function: ast.FunctionDef, array: str) -> list[int]:
    """Return the lines that use an array itself, or a slice of it."""
    elements = {
        id(node.value)
        for node in ast.walk(function)
        if isinstance(node, ast.Subscript) and array in elements_of(node) and isinstance(node.value, ast.Name)
    }
    return [
        node.lineno
        for node in ast.walk(function)
        if isinstance(node, ast.Name)
        and node.id == array
        and isinstance(node.ctx, ast.Load)
        and id(node) not in elements
    ]


def freed_too_early(function: ast.FunctionDef) -> list[str]:
    """Return the arrays made in a kernel whose elements are used after the last use of the array itself."""
    assignments = [
        (node.targets[0].id, node.value)
        for node in ast.walk(function)
        if isinstance(node, ast.Assign) and len(node.targets) == 1 and isinstance(node.targets[0], ast.Name)
    ]
    owners = [node.value for node in ast.walk(function) if isinstance(node, ast.Attribute)]
    owners = [node.value if isinstance(node, ast.Subscript) else node for node in owners]
    with_fields = {node.id for node in owners if isinstance(node, ast.Name)}
    found = []
    for array in {name for name, value in assignments if isinstance(value, ast.Call)}:
        typed = any(
            name == array
            and any(
                isinstance(a, ast.Name) and a.id.isupper()
                for a in (*value.args[1:], *(k.value for k in value.keywords))
            )
            for name, value in assignments
            if isinstance(value, ast.Call)
        )
        aliases = {
            name
            for name, value in assignments
            if isinstance(value, ast.Subscript | ast.Attribute)
            and array in elements_of(value)
            and (name in with_fields or typed)
        }
        if not (typed or aliases or array in with_fields.intersection(elements_of(function))):
            continue
        uses = [
            node
            for node in ast.walk(function)
            if (isinstance(node, ast.Subscript) and array in elements_of(node))
            or (isinstance(node, ast.Name) and node.id in aliases)
        ]
        returned = any(
            use in set(ast.walk(node)) for node in ast.walk(function) if isinstance(node, ast.Return) for use in uses
        )
        last = max((use.lineno for use in uses), default=0)
        if uses and (returned or max(whole_uses(function, array), default=0) <= last):
            found.append(array)
    return found


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_kernels_keep_the_rules(path: Path) -> None:
    for function in functions(path.read_text()):
        arguments = function.args
        assert len(arguments.args) <= MOST_ARGUMENTS, function.name
        assert all(argument.annotation is not None for argument in arguments.args), function.name
        assert function.returns is not None, function.name
        assert not freed_too_early(function), function.name


GOOD = """
@kernel
def handed_back(n):
    out = np.empty(n, LINE)
    for i in range(n):
        line = out[i]
        line.dx = 1.0
    return out[:n]
@kernel
def kept(n):
    out = np.empty(1, LINE)
    line = out[0]
    line.dx = 1.0
    total = line.dx + line.dy
    keep_alive(out)
    return total
"""
BAD = """
@kernel
def element(n):
    out = moved(n)
    return out[0].dx
@kernel
def alias(n):
    out = np.empty(1, LINE)
    line = out[0]
    line.dx = 1.0
    return line.dx
@kernel
def by_another_way(n):
    out = np.empty(1, LINE)
    line = out[0]
    if n > 0:
        return line.dx
    keep_alive(out)
    return 0.0
"""


def test_the_rule_finds_what_is_freed_too_early() -> None:
    assert [function.name for function in functions(GOOD) if freed_too_early(function)] == []
    assert [function.name for function in functions(BAD) if not freed_too_early(function)] == []
    assert len(list(functions(GOOD))) == 2
    assert len(list(functions(BAD))) == 3


LAYOUTS = sorted(path.parts[len(ROOT.parts)] for path in ROOT.glob("*/layout.py"))


@pytest.mark.parametrize("package", LAYOUTS)
def test_no_field_hides_behind_an_attribute_of_records(package: str) -> None:
    """As plain Python a kernel would read a method of numpy there, such as ``mean``."""
    layout = import_module(f"{package}.layout")
    records = [value for value in vars(layout).values() if isinstance(value, np.dtype) and value.names]
    assert records
    assert [name for one in records for name in one.names or () if hasattr(np.record, name)] == []


INNER = np.dtype([("a", "f8"), ("b", "i8")])
OUTER = np.dtype([("inner", INNER), ("c", "f8")])
ROOM = [[0.0, 0.0, 6.0, 0.0], [6.0, 0.0, 6.0, 2.0], [4.0, 2.0, 4.0, 5.0], [0.0, 5.0, 0.0, 0.0]]
REGISTER = """
import numba
from tests.compiled.test_kernels import answer
print(numba.config.DISABLE_JIT, *map(float.hex, answer()))
"""


def answer() -> list[float]:
    """Return pose and variance of the angle of a room that is seen 1 m to the right."""
    room, seen = Segments.from_array(ROOM), Segments.from_array(np.array(ROOM) - [1.0, 0.0, 1.0, 0.0])
    found = register(room, MeasuredSegments.from_segments(seen, 0.02), diagonal(len(ROOM)))
    assert found.covariance is not None
    pose = pose_of(found)
    return [pose.x, pose.y, pose.theta, float(found.covariance[2, 2])]


class Both(NamedTuple):
    """Arrays that belong together."""

    outers: Records
    numbers: Records


def whole(outers: Any, one: Any, both: Both) -> Any:
    """Read and write fields in every way that kernels do."""
    outers[1].inner.b = 7
    one.c = 3.0
    both.outers[0].c += one.c
    fresh = np.zeros(1, OUTER)
    fresh[0].inner.a = 5.0
    fresh[0].c = both.outers[0].inner.a + fresh[0].inner.a + both.numbers[0]
    return fresh[0].c


def test_fields_are_attributes_and_writing_reaches_the_array() -> None:
    outers, state = np.zeros(2, OUTER), np.zeros(1, OUTER)
    outers["inner"]["a"] = 2.0
    assert interpreted(whole)(outers, state[0], Both(outers, np.array([10.0]))) == 17.0
    assert outers["inner"]["b"].tolist() == [0, 7]
    assert (outers["c"].tolist(), state["c"].tolist()) == ([3.0, 0.0], [3.0])


def test_a_registration_that_is_not_compiled_gives_the_same_answer() -> None:
    ended = subprocess.run(
        [sys.executable, "-c", REGISTER],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"}, cwd=ROOT, capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    disabled, *numbers = ended.stdout.split()
    assert disabled == "1"
    expected = answer()
    assert expected[0] == pytest.approx(1.0)
    np.testing.assert_allclose([float.fromhex(number) for number in numbers], expected, rtol=1e-12, atol=1e-15)
