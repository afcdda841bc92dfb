"""Compiling kernels where none are kept from before, in a process that ends with it."""

from __future__ import annotations

import os
from importlib.util import find_spec
from pathlib import Path

from filelock import FileLock

PACKAGES = ("registration", "vectorization", "association")


def is_compiled() -> bool:
    """Tell whether something of every module of kernels is kept, though perhaps not of its present source."""
    for package in PACKAGES:
        home = _home(package)
        named = os.environ.get("NUMBA_CACHE_DIR")
        places = [home / "__pycache__"] if named is None else list(Path(named).glob(f"{package}_*"))
        for module in home.glob("_*kernels.py"):
            if not any(any(place.glob(f"{module.stem}.*.nbi")) for place in places):
                return False
    return True


def compile_kernels() -> None:
    """Compile everything, or wait for another process that does.

    The compiler keeps 330 MB, so whoever is to go on afterwards loads what another process has compiled.
    """
    place = Path(os.environ.get("NUMBA_CACHE_DIR", _home("association") / "__pycache__"))
    place.mkdir(parents=True, exist_ok=True)
    with FileLock(place / "linefix.lock"):
        if not is_compiled():
            from .warmup import warm_up

            warm_up()


def _home(package: str) -> Path:
    spec = find_spec(package)
    assert spec is not None
    assert spec.submodule_search_locations is not None
    return Path(spec.submodule_search_locations[0])
