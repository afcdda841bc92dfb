"""linefix as a program of its own."""

from __future__ import annotations

import subprocess
import sys

import pytest

from cli.logs import spread
from cli.printing import console


def test_it_starts_and_ends_as_a_program() -> None:
    command = [sys.executable, "-c", "from cli.entry import main; main()"]
    told = subprocess.run([*command, "--version"], capture_output=True, text=True, timeout=300, check=False)
    assert (told.returncode, told.stdout.split()[0], told.stderr) == (0, "linefix", "")
    wrong = subprocess.run([*command, "lokate"], capture_output=True, text=True, timeout=300, check=False)
    assert (wrong.returncode, wrong.stdout, wrong.stderr.count("\n")) == (2, "", 1)


def test_what_is_printed_is_taken_for_no_markup(capsys: pytest.CaptureFixture[str]) -> None:
    console().print("[bold]map[/bold] :robot: 1.5")
    assert capsys.readouterr().out == "[bold]map[/bold] :robot: 1.5\n"


def test_some_of_many_are_spread_evenly_and_of_none_none() -> None:
    assert spread([], 3) == []
    assert spread([1, 2], 3) == [1, 2]
    assert spread(list(range(10)), 5) == [0, 2, 4, 6, 8]
