"""Compiling kernels where none are kept from before, in a process that ends with it."""

from __future__ import annotations

import os
import subprocess
from contextlib import nullcontext

from filelock import FileLock

from registration import kept_kernels
from registration.many_kernels import compiling_many

from ..parsing.own_modules import command_of

BESIDE = "service.work.warmup"  # as a program it compiles what the search comes to late, or needs first
PACKAGES = ("registration", "vectorization", "association")


def is_compiled() -> bool:
    """Tell whether the kernels are kept for their present source."""
    return all(kept_kernels.is_compiled(package) for package in PACKAGES)


def compiled_share() -> float:
    """Return which share of the kernels is kept for their present source, 0 to 1; a few are never needed."""
    kept, present = map(sum, zip(*map(kept_kernels.how_many, PACKAGES), strict=True))
    return kept / present


def compile_kernels() -> None:
    """Compile everything, or wait for another process that does.

    The compiler keeps 330 MB, so whoever is to go on afterwards loads what another process has compiled. Where there is
    another core a process beside this one takes half: the compiler takes one core. Each kernel is kept as soon as it is
    compiled, so that the other process loads it; the halves are laid so that they seldom meet at one.
    """
    place = kept_kernels.cache_directory("association").parent
    place.mkdir(parents=True, exist_ok=True)
    with FileLock(place / "linefix.lock"):
        if is_compiled():
            return
        with compiling_many():
            alone = (os.cpu_count() or 1) == 1
            with nullcontext() if alone else subprocess.Popen(command_of(BESIDE), stdin=subprocess.PIPE) as beside:
                from .warmup import warm_up, warm_up_analyzing, warm_up_registering, warm_up_searching

                warm_up_registering()
                warm_up_searching()
                warm_up_analyzing()
                if beside is not None:
                    beside.wait()  # before its standard input is closed, at which it ends
            warm_up()
