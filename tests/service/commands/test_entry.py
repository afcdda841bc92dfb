"""linefix as a program of its own."""

from __future__ import annotations

import subprocess
import sys


def test_it_starts_and_ends_as_a_program() -> None:
    command = [sys.executable, "-c", "from service.commands.entry import main; main()"]
    told = subprocess.run([*command, "--version"], capture_output=True, text=True, timeout=300, check=False)
    assert (told.returncode, told.stdout.split()[0], told.stderr) == (0, "linefix", "")
    wrong = subprocess.run([*command, "lokate"], capture_output=True, text=True, timeout=300, check=False)
    assert (wrong.returncode, wrong.stdout, wrong.stderr.count("\n")) == (2, "", 1)
