"""Thresholds that kernels read, moved: each in a process that compiles the kernels which depend on it.

A process has a cache of its own, with links to the compiled kernels that do not depend on the threshold.
"""

from __future__ import annotations

import json
import os
import pickle
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from compiled import cache_directory

from .threshold_effects import MOVED, Effect, Told, effect_of, print_effects, sample, sample_of, timed
from .thresholds import Threshold, moved, thresholds


def run_compiled(count: int, chosen: Sequence[Threshold]) -> None:
    """Print the effects of some thresholds that kernels read on a sample of so many answers."""
    found = []
    numbers = [one.number for one in sample(count)]
    with tempfile.TemporaryDirectory() as folder:
        before, seconds = _answered(Path(folder), numbers, None, 1.0)
        for threshold in chosen:
            effects = []
            for factor in MOVED:
                try:
                    after, took = _answered(Path(folder), numbers, threshold, factor)
                    effects.append(effect_of(before, after, took / seconds))
                except subprocess.CalledProcessError as error:
                    effects.append(Effect(failed=(error.stderr.strip().splitlines() or ["no error"])[-1]))
            found.append((threshold, effects))
            print(f"{threshold.name}: {effects}", file=sys.stderr, flush=True)
    print_effects("Thresholds of kernels moved by 20 %: answers that change", found)


def _answered(
    folder: Path, numbers: Sequence[int], threshold: Threshold | None, factor: float
) -> tuple[list[Told], float]:
    """Answer the sample in a process of its own; return the answers and the processor time, seconds."""
    kernels = Path(tempfile.mkdtemp(dir=folder))
    _link_kernels(kernels, set() if threshold is None else dependent_kernels(threshold.name))
    name = "" if threshold is None else f"{threshold.module}.{threshold.name}"
    out = kernels / "out"
    task = json.dumps({"numbers": list(numbers), "name": name, "factor": factor, "out": str(out)})
    command = [sys.executable, "-m", "benchmarks.compiled_thresholds"]
    environment = {**os.environ, "LINEFIX_KERNELS": str(kernels)}
    subprocess.run(command, check=True, text=True, input=task, stderr=subprocess.PIPE, env=environment)
    told, seconds = pickle.loads(out.read_bytes())
    shutil.rmtree(kernels)
    return told, seconds


def _link_kernels(kernels: Path, left_out: set[str]) -> None:
    """Link the compiled kernels into another cache directory, without those of some names."""
    present = cache_directory()
    if present is None:
        return
    for path in [*present.rglob("*.nbi"), *present.rglob("*.nbc")]:
        if path.name.split("-")[0] in left_out:
            continue
        link = kernels / present.name / path.relative_to(present)
        link.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        os.link(path, link)


def dependent_kernels(name: str) -> set[str]:
    """Return the kernels that read a threshold, or call one that does, by module and name as their files have them."""
    found: dict[int, Any] = {}
    every = {id(one): one for one in _kernels()}
    grown = True
    while grown:
        grown = False
        for key, one in every.items():
            if key not in found and _reads(one.py_func, name, found):
                found[key] = one
                grown = True
    return {f"{Path(one.py_func.__code__.co_filename).stem}.{one.py_func.__qualname__}" for one in found.values()}


def _kernels() -> list[Any]:
    modules = [module for key, module in list(sys.modules.items()) if "kernels" in key.split(".")]
    return [value for module in modules for value in vars(module).values() if hasattr(value, "py_func")]


def _reads(function: Any, name: str, found: dict[int, Any]) -> bool:
    names = function.__code__.co_names
    return any(one == name or id(function.__globals__.get(one)) in found for one in names)


def main() -> None:
    """Read a task from stdin; answer its sample with one threshold moved before any kernel runs; write the answers."""
    task = json.load(sys.stdin)
    chosen = [one for one in thresholds() if f"{one.module}.{one.name}" == task["name"]]
    with ExitStack() as stack:
        for threshold in chosen:
            stack.enter_context(moved(threshold, threshold.moved(task["factor"])))
        some = sample_of(task["numbers"])
        timed(some, index_again=True)
        Path(task["out"]).write_bytes(pickle.dumps(timed(some, index_again=True)))


if __name__ == "__main__":
    main()
