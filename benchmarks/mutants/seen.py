"""A plugin of pytest that records which functions each test calls, and the order of tests for a mutant."""

from __future__ import annotations

import ast
import json
import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, FrameType

import pytest

RECORD = "LINEFIX_MUTANTS_RECORD"  # the environment variable that names the file of the record


@dataclass(frozen=True)
class Record:
    """Functions that each test of a suite calls in the process of the tests.

    Attributes
    ----------
    tests : dict
        By the identifier of a test: its duration, s, and the functions as ``path:line``, in the order of the run.
    failed : list of str
        Tests that fail without any mutant, and are left out.
    """

    tests: dict[str, tuple[float, list[str]]]
    failed: list[str]

    def order(self, module: str, line: int) -> list[str]:
        """Return the tests that call the function at a line, the fastest first; none where no test calls it.

        Of a line outside of functions, the tests that call some function of the module.
        """
        place = function_at(Path(module), line)
        wanted = place.__eq__ if place else lambda function: function.startswith(f"{module}:")
        called = [(seconds, test) for test, (seconds, functions) in self.tests.items() if any(map(wanted, functions))]
        return [test for _, test in sorted(called)]

    def seconds(self) -> float:
        """Return how long all tests took."""
        return sum(seconds for seconds, _ in self.tests.values())


def function_at(path: Path, line: int) -> str | None:
    """Return the innermost function around a line, as ``path:line``; None outside of functions."""
    nodes = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.FunctionDef)]
    begins = {node: min([node.lineno, *(one.lineno for one in node.decorator_list)]) for node in nodes}
    around = [begin for node, begin in begins.items() if begin <= line <= (node.end_lineno or 0)]
    return f"{path}:{max(around)}" if around else None


class _Recorder:
    """Functions that are called, each with the test or the shared fixture that calls it."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._now: set[CodeType] = set()
        self._fixtures: dict[str, set[CodeType]] = {}
        self._tests: dict[str, tuple[float, set[CodeType]]] = {}
        self._failed: list[str] = []

    def trace(self, frame: FrameType, event: str, argument: object) -> None:
        self._now.add(frame.f_code)

    @contextmanager
    def _into(self, codes: set[CodeType]) -> Iterator[None]:
        before, self._now = self._now, codes
        sys.settrace(self.trace)
        threading.settrace(self.trace)
        try:
            yield
        finally:
            self._now = before

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        codes: set[CodeType] = set()
        begun = time.perf_counter()
        with self._into(codes):
            result = yield
        for fixture in getattr(item, "fixturenames", ()):
            codes |= self._fixtures.get(fixture, set())
        self._tests[item.nodeid] = time.perf_counter() - begun, codes
        return result

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: pytest.FixtureDef[object]) -> Iterator[None]:
        if fixturedef.scope == "function":
            return (yield)
        with self._into(self._fixtures.setdefault(fixturedef.argname, set())):
            return (yield)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            self._failed.append(report.nodeid)

    def pytest_sessionfinish(self) -> None:
        sys.settrace(None)
        here = f"{Path.cwd()}{os.sep}"
        names: dict[CodeType, str] = {}
        for _, codes in self._tests.values():
            for code in codes - names.keys():
                if code.co_filename.startswith(here):
                    names[code] = f"{code.co_filename.removeprefix(here)}:{code.co_firstlineno}"
        rows = {
            test: (seconds, sorted({names[code] for code in codes & names.keys()}))
            for test, (seconds, codes) in self._tests.items()
            if test not in self._failed
        }
        self._path.write_text(json.dumps({"tests": rows, "failed": self._failed}))


def pytest_configure(config: pytest.Config) -> None:
    """Record where a file is named for it."""
    if RECORD in os.environ:
        config.pluginmanager.register(_Recorder(Path(os.environ[RECORD])))
