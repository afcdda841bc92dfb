"""Which mistakes are drawn, and which tests have to notice them."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from benchmarks.mutants.__main__ import ALL_KILLED, PACKAGES
from benchmarks.mutants.drawing import draw, modules_of, mutated
from benchmarks.mutants.rules import SUITES, known_equivalents, suite_of

ROOT = Path(__file__).parents[2]
MODULE = '''
from __future__ import annotations
from dataclasses import dataclass

@dataclass(frozen=True, slots=True)
class Pair:
    a: int | None = 3

@kernel
def larger(x: float | None, y: float) -> bool | None:
    """Compare 2 numbers."""
    return x > y

@lru_cache(maxsize=256)
def named(*, x: float) -> float:
    try:
        return x
    except (errors.Failure, OSError):
        raise
'''


@pytest.fixture
def project(tmp_path: Path) -> Path:
    (tmp_path / "package").mkdir()
    (tmp_path / "package" / "module.py").write_text(MODULE)
    (tmp_path / "package" / "tuning.py").write_text("LIMIT = 4\n")
    return tmp_path


def test_only_what_can_make_a_difference_is_drawn(project: Path) -> None:
    """Not annotations, flags of data classes, decorators of kernels and caches, bare stars, nor thresholds.

    Nor what Cosmic Ray fails at: the exception of another module.
    """
    drawn = draw(project, "package", 0, 1)
    assert {mutant.path for mutant in drawn} == {"package/module.py"}
    assert {mutant.before for mutant in drawn} == {
        "a: int | None = 3",
        "@dataclass(frozen=True, slots=True)",
        "return x > y",
        "except (errors.Failure, OSError):",
    }
    for mutant in drawn:
        text = mutated(project, mutant)
        ast.parse(text)
        assert text != MODULE
        assert mutant.after in text
        assert "slots=False" not in text
        assert "frozen=False" not in text


def test_a_seed_draws_the_same_mutants_and_another_others() -> None:
    once, again, other = (draw(ROOT, "service/admission/keys.py", 8, seed) for seed in (1, 1, 2))
    assert len(once) == 8
    assert once == again
    assert set(once) != set(other)
    assert len({(mutant.path, mutant.operator, mutant.occurrence) for mutant in once}) == 8


def test_a_change_elsewhere_leaves_what_is_drawn_in_its_order(project: Path) -> None:
    def drawn() -> list[tuple[str, str]]:
        return [(mutant.before, mutant.after) for mutant in draw(project, "package", 0, 1)]

    before = drawn()
    module = project / "package" / "module.py"
    module.write_text("def new(x):\n    return x * 7 + 3\n\n\n" + module.read_text())
    after = drawn()
    assert len(after) > len(before)
    assert [each for each in after if "* 7 + 3" not in each[0]] == before


def test_every_module_has_tests_that_are_there() -> None:
    for package in PACKAGES:
        for path in modules_of(ROOT, package):
            assert suite_of(path).tests
    for suite in SUITES.values():
        assert all((ROOT / test).exists() for test in suite.tests), suite
    assert all((ROOT / place).exists() for place in ALL_KILLED)


def test_what_is_known_to_make_no_difference_is_still_there() -> None:
    for (path, before, _), why in known_equivalents().items():
        assert why
        assert " ".join(before.split()) in " ".join((ROOT / path).read_text().split())
