"""Compiling kernels where none are kept from before, in a process that ends with it."""

from __future__ import annotations

import os
import subprocess

from filelock import FileLock

from registration import compiling

from ..parsing.own_modules import command_of

BESIDE = "service.work.warmup"  # as a program it compiles what registers and vectorizes
PACKAGES = ("registration", "vectorization", "association")


def is_compiled() -> bool:
    """Tell whether the kernels are kept for their present source."""
    return all(compiling.is_compiled(package) for package in PACKAGES)


def compile_kernels() -> None:
    """Compile everything, or wait for another process that does.

    The compiler keeps 330 MB, so whoever is to go on afterwards loads what another process has compiled. What registers
    and vectorizes is compiled by a process beside this one, where there is another core: the compiler takes one.
    """
    place = compiling.cache_directory("association").parent
    place.mkdir(parents=True, exist_ok=True)
    with FileLock(place / "linefix.lock"):
        if is_compiled():
            return
        from .warmup import warm_up, warm_up_searching

        if (os.cpu_count() or 1) > 1:
            with subprocess.Popen(command_of(BESIDE)):
                warm_up_searching()
        warm_up()
