"""The notebook runs from its first cell to its last, in a Python of its own."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

NOTEBOOK = Path(__file__).parents[2] / "examples" / "linefix.ipynb"


def cells() -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(NOTEBOOK.read_text())["cells"]
    return found


def test_it_is_kept_without_what_a_run_leaves() -> None:
    code = [cell for cell in cells() if cell["cell_type"] == "code"]
    assert len(code) >= 8
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code)


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
