"""The tests of each module, and the mutants that make no difference."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

EQUIVALENT = Path(__file__).with_name("equivalent.toml")


@dataclass(frozen=True, slots=True)
class Suite:
    """Tests that run together.

    Attributes
    ----------
    tests : tuple of str
        Folders and files.
    processes : bool
        True where tests start processes that run the code.
    compiled : bool
        True where kernels are compiled; where few tests call them, plain Python is faster.
    """

    tests: tuple[str, ...]
    processes: bool = False
    compiled: bool = True


SUITES = {
    "compiled/": Suite(("tests/compiled",)),
    "registration/": Suite(("tests/registration", "tests/association/test_estimation.py")),
    "vectorization/": Suite(("tests/vectorization",)),
    "association/index/kernels/": Suite(("tests/association/test_map_index.py",)),
    "association/scan/kernels/joining.py": Suite(("tests/association/kernels",)),
    "association/": Suite(("tests/association",)),
    "simulation/": Suite(("tests/simulation",)),
    "map_quality/": Suite(("tests/map_quality",)),
    "service/admission/": Suite(
        (
            "tests/service/admission",
            *(f"tests/service/http/test_{name}.py" for name in ("busy", "roles", "pages_of_others")),
        ),
        processes=True,
    ),
    "service/maps/": Suite(("tests/service/maps", "tests/service/http/test_maps.py"), processes=True),
    "service/parsing/": Suite(
        ("tests/service/parsing", "tests/service/http/test_bodies.py", "tests/service/http/test_refusals.py"),
        processes=True,
    ),
    "service/telemetry/": Suite(("tests/service/telemetry",), processes=True),
    "service/importing/": Suite(("tests/service/importing", "tests/service/http/test_importing.py"), processes=True),
    "cli/": Suite(("tests/cli",)),
    "service/http/": Suite(("tests/service/http",), processes=True),
    "linefix/documents/": Suite(
        (
            "tests/linefix/documents",
            *(f"tests/service/http/test_{name}.py" for name in ("refusals", "answers", "scans", "contract", "quality")),
        ),
        processes=True,
    ),
    "linefix/": Suite(("tests/linefix", "tests/cli")),
    "formats/": Suite(("tests/formats",)),
    "batch/": Suite(("tests/batch",), processes=True),
    "ros2/": Suite(("tests/ros2",), processes=True),
    "service/work/": Suite(
        ("tests/service/work", *(f"tests/service/http/test_{name}.py" for name in ("busy", "waiting", "answers"))),
        processes=True,
    ),
    "service/": Suite(
        (
            "tests/service/test_settings.py",
            "tests/service/maps/test_database.py",
            "tests/service/process",
            "tests/service/http/test_operations.py",
        ),
        processes=True,
    ),
}
"""By the beginning of a module's path; the first entry that fits is used."""


def suite_of(path: str) -> str:
    """Return the key in `SUITES` of the tests that must notice a mutant of a module."""
    return next(begin for begin in SUITES if path.startswith(begin))


def known_equivalents() -> dict[tuple[str, str, str], str]:
    """Return why mutants make no difference, by path, line before and line after; each was examined by hand."""
    entries = tomllib.loads(EQUIVALENT.read_text()).get("equivalent", [])
    return {
        (entry["path"], _plain(entry["before"]), _plain(after)): entry["why"]
        for entry in entries
        for after in entry["after"]
    }


def changed_lines(diff: str) -> tuple[str, str]:
    """Return the removed and the added lines of a unified diff, each joined into one line."""
    lines = diff.splitlines()
    removed = [line[1:] for line in lines if line.startswith("-") and not line.startswith("---")]
    added = [line[1:] for line in lines if line.startswith("+") and not line.startswith("+++")]
    return _plain(" ".join(removed)), _plain(" ".join(added))


def _plain(text: str) -> str:
    return " ".join(text.split())
