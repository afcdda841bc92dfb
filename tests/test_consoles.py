"""The output that documents show is that of their commands."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from examples.consoles import corrected, documents, faults, stage


@pytest.fixture(scope="module")
def place() -> Iterator[tuple[Path, str]]:
    with stage() as given:
        yield given


PARTS = [pytest.param(path, marks=[pytest.mark.long] * (path.name != "README.md")) for path in documents()]


@pytest.mark.parametrize("document", PARTS, ids=lambda path: path.name)
def test_the_output_of_the_blocks_is_as_shown(document: Path, place: tuple[Path, str]) -> None:
    assert faults(document, *place) == []


@pytest.mark.parametrize(
    ("shown", "output", "right"),
    [
        ('{"x": 1.0, ...}', '{"x":0.98,"y":2}\n', '{"x": 1.0, ...}'),
        ('{"x": 1.1, ...}', '{"x":0.98,"y":2}', '{"x": 1.0, ...}'),
        ("v 7.1e-5, took 3 ms", "v  0.0000723, took 99.5 ms", "v 7.2e-5, took 3 ms"),
        ("walls  56", "sigma 1\nwalls   57\n", "walls  57"),
        ("hq-3 has 2", "hq-3 has 3", "hq-3 has 3"),
        ("hq-3 has 2", "hq-4 has 2", None),
        ("walls 56", "points 56", None),
    ],
)
def test_numbers_are_corrected_and_other_differences_found(shown: str, output: str, right: str | None) -> None:
    assert corrected(shown, output) == right


def test_a_command_that_fails_is_a_fault(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("<!-- run -->\n```\necho some; false\n```\n")
    assert "failed with status 1" in faults(page, tmp_path, "http://127.0.0.1:1")[0]
