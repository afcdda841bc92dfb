"""Names of `linefix`, which work as their docstrings state, and the notebook from its first cell to its last."""

from __future__ import annotations

import doctest
import inspect
import json
import re
import subprocess
import sys
from dataclasses import FrozenInstanceError, fields, is_dataclass
from pathlib import Path
from typing import Any

import pytest

import association
import linefix
import map_quality
import registration
import vectorization
from linefix import checking, locating, ranges, updating

ROOT = Path(linefix.__file__).parent.parent


def test_exports_are_sorted_and_complete() -> None:
    assert linefix.__all__ == sorted(linefix.__all__)
    assert dir(linefix) == linefix.__all__
    with pytest.raises(AttributeError, match="locate_all"):
        linefix.locate_all  # noqa: B018


def test_the_reference_has_every_name() -> None:
    page = (ROOT / "docs" / "reference" / "python.md").read_text()
    listed = re.findall(r"^\.\. auto(?:function|class|module|exception):: (\w+)$", page, re.MULTILINE)
    assert sorted([*listed, "simulation"]) == linefix.__all__


@pytest.mark.parametrize("name", linefix.__all__)
def test_every_name_says_what_it_is(name: str) -> None:
    described = inspect.getdoc(getattr(linefix, name))
    assert described
    assert not described.startswith(f"{name}(")


VALUES = [
    pytest.param(member, id=f"{package.__name__}.{name}")
    for package in (registration, vectorization, association, map_quality, linefix)
    for name in package.__all__
    if inspect.isclass(member := getattr(package, name)) and is_dataclass(member) and name != "Deadline"
]


@pytest.mark.parametrize("kind", VALUES)
def test_assigning_to_a_value_fails(kind: type) -> None:
    """A deadline alone can change: another thread cancels it."""
    assert is_dataclass(kind)
    for field in fields(kind):
        with pytest.raises(FrozenInstanceError):
            setattr(object.__new__(kind), field.name, 99)


@pytest.mark.parametrize("module", [linefix, checking, locating, ranges, updating], ids=lambda module: module.__name__)
def test_examples_give_what_they_show(module: object) -> None:
    failed, tried = doctest.testmod(module)  # type: ignore[arg-type]
    assert (failed, tried > 0) == (0, True)


def test_types_are_told_to_whoever_imports_it() -> None:
    packages = ("linefix", "registration", "vectorization", "association", "simulation", "formats")
    assert [one for one in packages if not (ROOT / one / "py.typed").is_file()] == []


def test_it_is_there_without_the_libraries_of_formats() -> None:
    """The error names the extra that is missing for a file."""
    program = (
        "import sys; sys.modules['ezdxf'] = sys.modules['rosbags'] = None\n"
        "import linefix\n"
        "try: linefix.read_map\n"
        "except ModuleNotFoundError as error: print(error)\n"
    )
    ended = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    assert "linefix.read_map requires the extra `formats`" in ended.stdout


KINDS = {"stream": "print(", "display_data": "plt.show()"}
WORD = re.compile(r"[a-z_]{3,}")  # numbers may differ in their last digits between machines
NOTEBOOK = Path(__file__).parents[2] / "examples" / "linefix.ipynb"


def cells() -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(NOTEBOOK.read_text())["cells"]
    return found


def printed(cell: dict[str, Any]) -> str:
    """Return the stored text output of a cell."""
    return "".join("".join(one["text"]) for one in cell["outputs"] if one["output_type"] == "stream")


def test_every_output_is_stored() -> None:
    code = [cell for cell in cells() if cell["cell_type"] == "code"]
    assert len(code) >= 8
    for cell in code:
        source = "".join(cell["source"])
        kinds = {one["output_type"] for one in cell["outputs"]}
        assert kinds == {kind for kind, word in KINDS.items() if word in source}, source


@pytest.mark.long
def test_it_runs(tmp_path: Path) -> None:
    """Its cells are a program; what a kernel of Jupyter adds is the showing."""
    pytest.importorskip("matplotlib")
    program = "\n\n".join("".join(cell["source"]) for cell in cells() if cell["cell_type"] == "code")
    program = "import matplotlib; matplotlib.use('Agg')\n" + program.replace("plt.show()", "plt.close()")
    command = [sys.executable, "-W", "error", "-c", program]
    ended = subprocess.run(command, cwd=NOTEBOOK.parents[1], capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    assert "ok True" in ended.stdout
    assert "ambiguous False" in ended.stdout
    stored = "".join(printed(cell) for cell in cells() if cell["cell_type"] == "code")
    assert WORD.findall(ended.stdout) == WORD.findall(stored)
