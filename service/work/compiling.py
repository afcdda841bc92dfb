"""Compiling kernels where none are kept from before, in a process that ends with it."""

from __future__ import annotations

from filelock import FileLock

from registration import compiling

PACKAGES = ("registration", "vectorization", "association")


def is_compiled() -> bool:
    """Tell whether the kernels are kept for their present source."""
    return all(compiling.is_compiled(package) for package in PACKAGES)


def compile_kernels() -> None:
    """Compile everything, or wait for another process that does.

    The compiler keeps 330 MB, so whoever is to go on afterwards loads what another process has compiled.
    """
    place = compiling.cache_directory("association").parent
    place.mkdir(parents=True, exist_ok=True)
    with FileLock(place / "linefix.lock"):
        if not is_compiled():
            from .warmup import warm_up

            warm_up()
