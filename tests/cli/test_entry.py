"""linefix as a program of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import cli
from cli.printing import print_lines, table
from tests.map_quality.check.drawn import faces

from .drives import write_log

ROOT = Path(cli.__file__).parent.parent


def test_it_starts_and_ends_as_a_program() -> None:
    command = [sys.executable, "-c", "from cli.entry import main; main()"]
    told = subprocess.run([*command, "--version"], capture_output=True, text=True, timeout=300, check=False)
    assert (told.returncode, told.stdout.split()[0], told.stderr) == (0, "linefix", "")
    wrong = subprocess.run([*command, "lokate"], capture_output=True, text=True, timeout=300, check=False)
    assert (wrong.returncode, wrong.stdout, wrong.stderr.count("\n")) == (2, "", 1)


def test_lines_are_printed_as_they_are_without_control_characters(capsys: pytest.CaptureFixture[str]) -> None:
    print_lines(["[bold]map[/bold] :robot: 1.5\x1b[31m"])
    assert capsys.readouterr().out == "[bold]map[/bold] :robot: 1.5?[31m\n"


def test_numbers_stand_on_the_right_of_their_column() -> None:
    lines = table(("name", "scans", "of"), [("a", 5, None), ("hall", 1.25, "x")])
    assert list(lines) == ["name  scans  of", "a         5  -", "hall  1.250  x"]


def test_help_imports_nothing_that_computes_and_a_replay_no_service(folder: Path) -> None:
    """Each in a process of its own: what was imported is in `sys.modules`."""
    (folder / "floor.json").write_text(json.dumps({"segments": faces().tolist()}))
    write_log(folder / "drive.log", 3)
    heavy = ("numpy", "pydantic", "scipy", "numba", "sqlalchemy", "fastapi", "service")
    for arguments, unwanted in (
        (["--help"], heavy),
        (["replay", "drive.log", "--map", "floor.json", "--json"], ("service", "sqlalchemy", "fastapi")),
    ):
        program = (
            "import sys; from cli.entry import run; "
            f"code = run({arguments!r}); print(code, [one for one in {unwanted!r} if one in sys.modules])"
        )
        ended = subprocess.run(
            [sys.executable, "-c", program], cwd=folder, env={**os.environ, "PYTHONPATH": str(ROOT)},
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        assert ended.stdout.splitlines()[-1] == "0 []", ended.stderr
