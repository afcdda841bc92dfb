"""The links, files, modules, targets and tests that the documents name exist."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

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
