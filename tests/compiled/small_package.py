"""A package of two kernels on disk, that is run in processes of its own."""

from __future__ import annotations

import ctypes
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]

INNER = """
from compiled import kernel
from ..layout import FACTOR
@kernel
def inner(x: float) -> float:
    return FACTOR * x + 1.0
"""
OUTER = """
from compiled import kernel
from .inner import inner
@kernel
def outer(x: float) -> float:
    return 2.0 * inner(x)
"""
RUN = """
import compiled.cache
compiled.cache.PACKAGES = ("small",)
from small.kernels.outer import outer
print(outer(1.0), sum(outer.stats.cache_hits.values()), compiled.cache_directory())
"""

# Imports Numba once: a process for each line that it reads.
STARTER = """
import json, os, sys, tempfile
import numba
numba.njit(lambda x: 2.0 * x)(1.0)
for line in sys.stdin:
    asked = json.loads(line)
    if pid := os.fork():
        print(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]), flush=True)
        continue
    for number, file in enumerate(asked["files"], 1):
        os.dup2(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
    os.environ.clear()
    os.environ.update(asked["environment"])
    sys.path[:0], tempfile.tempdir = asked["paths"], None
    numba.config.reload_config()
    exec(asked["program"])
    break
"""


@dataclass(frozen=True)
class Starter:
    """Starts processes that have imported Numba, to which the permissions of files apply even for root."""

    process: subprocess.Popen[str]

    @classmethod
    @contextmanager
    def begun(cls) -> Iterator[Starter]:
        with subprocess.Popen(
            [sys.executable, "-c", STARTER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            env=os.environ | {"PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"}, preexec_fn=_obey_permissions,
        ) as process:  # fmt: skip
            yield cls(process)
            assert process.stdin is not None
            process.stdin.close()

    def run(self, program: str, folder: Path, environment: dict[str, str]) -> tuple[str, str]:
        """Run a program that finds packages in a folder; return its output and its log."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        out, err = files = folder / "out", folder / "err"
        asked = {"program": program, "files": [*map(str, files)], "paths": [str(folder)], "environment": environment}
        self.process.stdin.write(json.dumps(asked) + "\n")
        self.process.stdin.flush()
        assert self.process.stdout.readline() == "0\n", err.read_text()
        return out.read_text(), err.read_text()


@dataclass(frozen=True)
class Ran:
    """Output of a process that ran the kernel of the small package."""

    answer: float
    loaded: bool
    directory: Path
    log: str


@dataclass(frozen=True)
class SmallPackage:
    """A package on disk: kernel `outer` calls `inner`, which stands in another file and reads a third."""

    home: Path
    starter: Starter

    @classmethod
    def write(cls, parent: Path, starter: Starter) -> SmallPackage:
        package = cls(parent / "small", starter)
        (package.home / "kernels").mkdir(parents=True)
        for name, text in {"__init__": "", "layout": "FACTOR = 10.0\n"}.items():
            (package.home / f"{name}.py").write_text(text)
        for name, text in {"__init__": "", "inner": INNER, "outer": OUTER}.items():
            (package.home / "kernels" / f"{name}.py").write_text(text)
        return package

    def edit(self, file: str, old: str, new: str) -> None:
        path = self.home / file
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new))

    def run(self, more: str = "", **environment: object) -> Ran:
        """Run the kernel in a process of its own."""
        left = ("LINEFIX_KERNELS", "NUMBA_CACHE_DIR", "XDG_CACHE_HOME")
        clean = {name: value for name, value in os.environ.items() if name not in left}
        clean |= {name: str(value) for name, value in environment.items()}
        out, log = self.starter.run(RUN + more, self.home.parent, clean)
        answer, hits, directory = out.split()
        return Ran(float(answer), hits == "1", Path(directory), log)


def _obey_permissions() -> None:
    """Take from root what lets it write and read everything."""
    if os.geteuid() == 0:
        for capability in (1, 2):  # CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH
            assert ctypes.CDLL(None).prctl(24, capability, 0, 0, 0) == 0  # PR_CAPBSET_DROP
