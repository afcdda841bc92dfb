"""Compile the kernels that a first search needs, in processes that end afterwards: the compiler takes 330 MB."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from contextlib import nullcontext, suppress
from pathlib import Path
from tempfile import gettempdir
from typing import IO

from compiled import cache_directory, is_complete, mark_complete

from . import warmup

STANDARD_INPUT = 0
PROGRAM = "import sys; sys.path[:] = {path!r}; from linefix import compiling; compiling.run({task!r})"


def start_compiler(task: str = "compile_kernels") -> subprocess.Popen[bytes]:
    """Start a process that compiles the kernels that are not cached; it ends with this one."""
    # In a group of its own, so that Ctrl-C is for this process. Not by `python -m`, which would import from the working
    # folder first.
    command = [sys.executable, "-c", PROGRAM.format(path=sys.path, task=task)]
    return subprocess.Popen(command, stdin=subprocess.PIPE, process_group=0)


def compile_kernels() -> None:
    """Compile every kernel that a first search needs, or wait for another process that does.

    If there is a second core, a second process compiles about half of the kernels.
    """
    directory = cache_directory()
    with ((directory or Path(gettempdir())) / "linefix.lock").open("w") as lock:
        _hold(lock)
        if is_complete():
            return
        alone = (os.cpu_count() or 1) == 1 or directory is None
        with nullcontext() if alone else start_compiler("compile_second_half") as second:
            warmup.warm_up_searching()
            if second is not None:
                second.wait()  # its standard input is open until here: when it closes, the process ends
        warmup.warm_up()
        mark_complete()


def _hold(lock: IO[str]) -> None:
    """Wait for a lock that ends with the file or the process; where there is none, several processes may compile."""
    with suppress(ModuleNotFoundError):
        import fcntl

        fcntl.flock(lock, fcntl.LOCK_EX)


def run(task: str) -> None:
    """Run a function of this module in a process of its own."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    {"compile_kernels": compile_kernels, "compile_second_half": warmup.warm_up_second_half}[task]()


def _end_with_parent() -> None:
    """End when the parent process has ended and so closed this one's standard input, however that went."""
    while os.read(STANDARD_INPUT, 1):
        pass
    os._exit(1)
