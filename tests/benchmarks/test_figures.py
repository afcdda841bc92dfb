"""The figures that documents quote are those of the results file."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from benchmarks.figures import (
    QUOTED,
    ROOT,
    Quote,
    documents,
    expected,
    pages_with_tables,
    quotes,
    results,
    rewrite,
    rewrite_tables,
    wrong,
    wrong_tables,
)

MEASURED = re.compile(
    r"(?<![\w.])\d[\d,.]* (?:ms\b|of [\d,]{2,}|requests per second|scans per second)"
    r"|(?<![\w.])\d+\.\d+ ?%|(?<![\w.,])[\d.,]{2,} MB"
)
PRINTED = re.compile(r"<!-- output -->\n+```.*?```", re.DOTALL)  # compared by `examples.consoles`
# Text that looks like a figure and is a limit, a default, an example or a property of the method.
SETTINGS = {
    "docs/guides/deployment.md": ["112 MB"],
    "docs/guides/keep-the-map-true.md": ["16 of 16", "2 of 2", "0.5 %"],
    "docs/guides/security.md": ["32 MB", "96 MB", "64 MB", "50 ms"],
    "docs/explanation/method.md": ["0.4 %"],
    "docs/guides/read-the-answer.md": ["0.4 %"],
    "docs/reference/http/associate.md": ["0.4 %"],
    "docs/reference/http/check.md": ["50 MB"],
    "docs/reference/http/operations.md": ["50 ms"],
    "docs/reference/limits.md": ["99.9 %"],
    "docs/reference/http/register.md": ["99.9 %"],
}


def quote(shown: str, unit: str = "") -> Quote:
    return Quote(ROOT / "README.md", shown, unit, "run", "what", (0, 0))


@pytest.mark.parametrize("document", documents(), ids=lambda path: path.name)
def test_every_figure_of_quality_or_speed_is_quoted_as_it_is_in_the_file(document: Path) -> None:
    assert [fault for one in quotes(document) if (fault := wrong(one, results()))] == []
    text = PRINTED.sub("", QUOTED.sub("", document.read_text()))
    allowed = SETTINGS.get(str(document.relative_to(ROOT)), [])
    assert [found[0] for found in MEASURED.finditer(text) if found[0] not in allowed] == []


def test_the_documents_have_many_quotes_and_tables() -> None:
    assert sum(1 for document in documents() for _ in quotes(document)) > 40
    assert any("<!-- table: localization -->" in page.read_text() for page in pages_with_tables())


def test_every_run_names_its_origin() -> None:
    for name, run in results().items():
        assert run.keys() == {"command", "commit", "date", "machine", "load", "figures"}, name
        assert all(run.values()), name


@pytest.mark.parametrize(
    ("shown", "unit", "measured", "right"),
    [
        ("95", "%", "0.947", "95"),
        ("94.7", "%", "0.947", "94.7"),
        ("0.14", "%", "0.14 (5 of 3598)", "14.00"),
        ("98.4", "%", "98.4 %", "98.4"),
        ("5 of 3,598", "", "0.14 (5 of 3598)", "5 of 3,598"),
        ("1,488", "ms", "1488.10", "1,488"),
        ("1", "ms", "nothing", "not measured"),
    ],
)
def test_a_figure_is_compared_with_the_digits_that_are_shown(shown: str, unit: str, measured: str, right: str) -> None:
    assert expected(quote(shown, unit), measured) == right


def test_a_figure_that_differs_is_found_and_corrected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("benchmarks.figures.ROOT", tmp_path)
    page = tmp_path / "page.md"
    page.write_text("right in 95 %<!--= plans: right -->, in 1.0 ms<!--= plans: gone -->")
    runs = {"plans": {"figures": {"right": "0.912"}}}
    assert [wrong(one, runs) for one in quotes(page)] == [
        "page.md: 95 %: plans: right is 91",
        "page.md: 1.0 ms: the file has no figure plans: gone",
    ]
    rewrite(page, runs)
    assert page.read_text().startswith("right in 91 %<!--")


@pytest.mark.parametrize("page", pages_with_tables(), ids=lambda path: path.name)
def test_tables_are_those_of_the_file(page: Path) -> None:
    assert list(wrong_tables(page, results())) == []


def test_a_table_that_differs_is_found_and_filled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("benchmarks.figures.ROOT", tmp_path)
    page = tmp_path / "page.md"
    page.write_text(
        "before\n<!-- table: plans -->\n| right | 0.95 |\n<!-- end -->\n<!-- table: gone -->\n<!-- end -->\n"
    )
    run = {"command": "c", "commit": "abc", "date": "d", "machine": "m", "load": "l", "figures": {"right": "0.912"}}
    runs = {"plans": run}
    expected_faults = ["page.md: the table of plans differs from the file", "page.md: the file has no run gone"]
    assert list(wrong_tables(page, runs)) == expected_faults
    rewrite_tables(page, runs)
    assert "| right | 0.912 |\n" in page.read_text()
    assert "| right | 0.95 |" not in page.read_text()
    assert page.read_text().startswith("before\n")
    assert list(wrong_tables(page, runs)) == expected_faults[1:]
