"""Mutation tests: which mutants are drawn, which tests must notice them, and the report."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.mutants.__main__ import PACKAGES, modules_of, prepare, report, run
from benchmarks.mutants.suites import SUITES, Suite, changed_lines, known_equivalents, suite_of

ROOT = Path(__file__).parents[2]
MODULE = """
from __future__ import annotations

from functools import lru_cache


@lru_cache
def larger(x: float | None, y: float) -> bool:
    return x > y
"""
TEST = """
from package.module import larger


def test_larger() -> None:
    assert larger(2.0, 1.0)
    assert not larger(1.0, 2.0)
"""


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "package").mkdir()
    (tmp_path / "package" / "module.py").write_text(MODULE)
    (tmp_path / "package" / "tuning.py").write_text("LIMIT = 4\n")
    (tmp_path / "test_module.py").write_text(TEST)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.long
def test_a_run_reports_the_mutants_that_no_test_notices(project: Path) -> None:
    """`x >= y` differs from `x > y` only for equal numbers, which the tests leave out."""
    session = project / "session.sqlite"
    prepare(session, modules_of(project, "package"), 0, 1)
    run(session, Suite(("test_module.py",)))
    _, row, *survivors = report({"package": [session]})
    _, drawn, ran, killed, equal, _ = row.split()
    assert int(drawn) == int(ran) >= 5
    assert int(killed) == int(ran) - len(survivors)
    assert equal == "0"
    assert survivors == ["package/module.py:9  return x > y  ->  return x >= y"]


@pytest.mark.long
def test_tests_that_fail_without_a_mutant_are_an_error(project: Path) -> None:
    session = project / "session.sqlite"
    prepare(session, modules_of(project, "package"), 0, 1)
    (project / "test_module.py").write_text("def test() -> None:\n    assert False\n")
    with pytest.raises(SystemExit, match="fail without any mutant"):
        run(session, Suite(("test_module.py",)))


def test_changed_lines_are_read_from_a_diff() -> None:
    assert changed_lines("--- a\n+++ b\n@@ -1 +1 @@\n before\n-  x =  1\n+  x =  2\n") == ("x = 1", "x = 2")


def test_every_module_has_tests_that_exist() -> None:
    for package in PACKAGES:
        for path in modules_of(ROOT, package):
            assert SUITES[suite_of(str(path))].tests
    for begin, suite in SUITES.items():
        assert (ROOT / begin).exists(), begin
        assert all((ROOT / test).exists() for test in suite.tests), suite


def test_known_equivalents_still_exist() -> None:
    for (path, before, _), why in known_equivalents().items():
        assert why
        assert before in " ".join((ROOT / path).read_text().split())
