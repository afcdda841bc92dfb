"""A package of two kernels on disk, that is run in processes of its own."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
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

    @classmethod
    def write(cls, parent: Path) -> SmallPackage:
        package = cls(parent / "small")
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
        """Run the kernel in a process of its own, to which the permissions of files apply even for root."""
        left = ("LINEFIX_KERNELS", "NUMBA_CACHE_DIR", "XDG_CACHE_HOME")
        clean = {name: value for name, value in os.environ.items() if name not in left}
        clean |= {"PYTHONPATH": f"{self.home.parent}{os.pathsep}{ROOT}", "PYTHONDONTWRITEBYTECODE": "1"}
        clean |= {name: str(value) for name, value in environment.items()}
        ended = subprocess.run(
            [sys.executable, "-c", RUN + more], env=clean, cwd=self.home.parent, capture_output=True, text=True,
            timeout=120, preexec_fn=_obey_permissions, check=False,
        )  # fmt: skip
        assert ended.returncode == 0, ended.stderr
        answer, hits, directory = ended.stdout.split()
        return Ran(float(answer), hits == "1", Path(directory), ended.stderr)


def _obey_permissions() -> None:
    """Take from root what lets it write and read everything."""
    if os.geteuid() == 0:
        for capability in (1, 2):  # CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH
            assert ctypes.CDLL(None).prctl(24, capability, 0, 0, 0) == 0  # PR_CAPBSET_DROP
