"""The notebook runs from its first cell to its last, in a Python of its own."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

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
