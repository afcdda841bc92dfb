"""The output that documents show is that of their commands, and what they name exists."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from examples.consoles import corrected, documents, faults, stage

ROOT = Path(__file__).parent.parent
DOCUMENTS = sorted(
    [
        *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md")),
        *(path for folder in ("docs", "examples", "deploy", "clients") for path in ROOT.glob(f"{folder}/**/*.md")),
    ]
)
MADE = "out/"  # what a command writes is there only afterwards
LINK = re.compile(r"\]\((?!https?:|#)([^)\s#]+)")
PLACE = re.compile(r"\]\((?!https?:)([^)\s#]*)#([^)\s]+)\)")
FILE = re.compile(r"(?<![\w./-])(?:[\w.*-]+/)+[\w*-]+\.(?:py|json|md|png|csv|cpp|toml)\b")
FOLDER = re.compile(r"`((?:service|association|registration|vectorization|simulation|tests|docs|examples)/[\w/.-]*)`")
MODULE = re.compile(r"python -m ([a-z_.]+)")
TARGET = re.compile(r"`make ([a-z-]+)|^make ([a-z-]+)", re.MULTILINE)
TEST = re.compile(r"`(test_\w+)`")


def anchors(document: Path) -> set[str]:
    """Return the anchors of the headings of a document, as GitHub and MyST make them."""
    text = re.sub(r"^```.*?^```", "", document.read_text(), flags=re.MULTILINE | re.DOTALL)
    headings = re.findall(r"^#+ (.*)$", text, flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def missing(document: Path) -> Iterator[str]:
    text = document.read_text()
    for path in {*LINK.findall(text)}:
        if not (document.parent / path).exists():
            yield f"link to {path}"
    for path, anchor in {*PLACE.findall(text)}:
        target = document.parent / path if path else document
        if target.suffix == ".md" and target.exists() and anchor not in anchors(target):
            yield f"link to {path}#{anchor}"
    rest = LINK.sub("", text)
    for path in {*FILE.findall(rest), *FOLDER.findall(rest)}:
        if not path.startswith(MADE) and not any(ROOT.glob(path.rstrip("/"))):
            yield path
    for module in {*MODULE.findall(text)} - {"pytest"}:
        place = ROOT / module.replace(".", "/")
        if not place.with_suffix(".py").exists() and not (place / "__main__.py").exists():
            yield f"python -m {module}"
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for target in {first or second for first, second in TARGET.findall(text)} - targets:
        yield f"make {target}"
    tests = "\n".join(path.read_text() for path in ROOT.glob("tests/**/test_*.py"))
    for test in {*TEST.findall(text)}:
        if f"def {test}(" not in tests:
            yield test


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_what_a_document_points_at_is_there(document: Path) -> None:
    assert sorted(missing(document)) == []


def test_what_the_makefile_names_is_there() -> None:
    makefile = (ROOT / "Makefile").read_text()
    named = re.findall(r"(?<![\w/$(.)-])(?:tests|requirements|web|\.ci|docs)/[\w./-]*\w", makefile)
    assert "tests/faults" in named
    assert [name for name in named if not (ROOT / name).exists()] == []


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
