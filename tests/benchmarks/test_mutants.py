"""Which mutants are drawn and which tests must notice them; the manifest of the models belongs to the code."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from association.verdict.features import Features
from association.verdict.model import MANIFEST, MODELS
from benchmarks import manifest
from benchmarks.examples import RANGES, SEGMENTS
from benchmarks.manifest import FORMAT, MODELS_FILE, UNKNOWN, accept, digest
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


def test_nothing() -> None:
    pass
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
    """`x >= y` differs from `x > y` only for equal numbers, which the tests leave out; one test does not call it."""
    session = project / "session.sqlite"
    prepare(session, modules_of(project, "package"), 0, 1)
    run(session, Suite(("test_module.py",)))
    _, row, *survivors = report({"package": [session]})
    _, drawn, ran, killed, equal, _ = row.split()
    assert int(drawn) == int(ran) >= 5
    assert int(killed) == int(ran) - len(survivors)
    assert equal == "0"
    assert survivors == ["package/module.py:9  return x > y  ->  return x >= y"]
    assert session.with_suffix(".tests").read_text() == "test_module.py::test_larger"


@pytest.mark.long
def test_tests_that_fail_without_a_mutant_are_left_out(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    session = project / "session.sqlite"
    prepare(session, modules_of(project, "package"), 0, 1)
    (project / "test_module.py").write_text("def test() -> None:\n    assert False\n")
    with pytest.raises(SystemExit, match="no test passes"):
        run(session, Suite(("test_module.py",)))
    assert "test_module.py::test\n" in capsys.readouterr().out


def test_what_is_no_python_is_not_drawn(project: Path) -> None:
    rows = []
    for value in ("{}", "{**values, **values}"):
        (project / "package" / "module.py").write_text(f"def same(values):\n    return {value} is values\n")
        prepare(project / value, modules_of(project, "package"), 0, 1)
        rows += list(report({"package": [project / value]}))[1:]
    assert rows[0] == rows[1]


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


def test_the_features_are_those_of_the_code_in_order() -> None:
    assert MANIFEST["format"] == FORMAT
    assert tuple(MANIFEST["code"]["features"]) == Features._fields


def test_the_models_are_fitted_to_the_present_code() -> None:
    """Or a reason why they still hold is on record: python -m benchmarks.manifest --accept REASON."""
    assert MANIFEST["code"]["digest"] == digest(), "fit the models again, or accept them: see CONTRIBUTING"
    accepted = MANIFEST["code"]["accepted"]
    assert digest() in {MANIFEST["code"]["at_fit"], *(one["digest"] for one in accepted)}
    assert all(one["reason"] for one in accepted)


@pytest.mark.parametrize("name", sorted(MODELS))
def test_a_model_has_features_of_the_code(name: str) -> None:
    assert set(MODELS) == {SEGMENTS, RANGES} == set(MANIFEST["data"]) == set(MANIFEST["metrics"])
    for odds in (MODELS[name].wrong, MODELS[name].elsewhere):
        assert set(odds.curves) <= set(Features._fields)


def test_the_digest_is_of_what_defines_the_features(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    here, before = tmp_path / "association" / "verdict", digest()
    for pattern in manifest.DEFINITION:
        for path in manifest.ROOT.glob(pattern):
            copy = tmp_path / path.relative_to(manifest.ROOT)
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_text(path.read_text())
    monkeypatch.setattr(manifest, "ROOT", tmp_path)
    assert digest() == before
    text = (here / "tuning.py").read_text()
    (here / "tuning.py").write_text("# A comment.\n" + text)
    assert digest() == before
    (here / "tuning.py").write_text(text.replace("COMPARED = 12", "COMPARED = 13"))
    assert digest() != before


def test_models_are_accepted_for_changed_code_with_a_reason(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    copy = tmp_path / "models.json"
    document = json.loads(MODELS_FILE.read_text())
    document["manifest"]["code"]["digest"] = UNKNOWN
    copy.write_text(json.dumps(document))
    monkeypatch.setattr(manifest, "MODELS_FILE", copy)
    accept("Nothing but names changed.")
    code = json.loads(copy.read_text())["manifest"]["code"]
    assert code["digest"] == digest()
    assert code["accepted"][-1] == {"digest": digest(), "reason": "Nothing but names changed."}
