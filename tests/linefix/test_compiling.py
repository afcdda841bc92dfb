"""Compiling in two processes, neither of which outlives the other."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.running import family_of, is_running, until

SOON = 10.0  # s; half of what its part would take on an idle machine
COMPILE = "from linefix.compiling import compile_kernels; compile_kernels()"


@pytest.mark.skipif((os.cpu_count() or 1) == 1, reason="one core compiles alone")
def test_a_compiler_that_is_killed_takes_the_other_with_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It went on for as long as its half took, 20 s of a core, and blocked the reader of its output."""
    monkeypatch.setenv("LINEFIX_KERNELS", str(tmp_path))
    with subprocess.Popen([sys.executable, "-c", COMPILE]) as compiler:
        until(lambda: len(family_of(compiler.pid)) == 2 and any(tmp_path.rglob("walls.*.nbc")))
        (beside,) = set(family_of(compiler.pid)) - {compiler.pid}
        compiler.kill()
    until(lambda: not is_running(beside), SOON)
