"""Compiling the kernels that a first request needs, in a process that ends afterwards."""

from __future__ import annotations

import os
import subprocess
from contextlib import nullcontext
from pathlib import Path
from tempfile import gettempdir

from filelock import FileLock

from compiled import cache_directory, is_complete, mark_complete

from ..parsing.parser_process import command_of

SECOND = "service.work.warmup"  # run as a program, it compiles about half of the kernels


def compile_kernels() -> None:
    """Compile every kernel that a first request needs, or wait for another process that does.

    The compiler takes several hundred MB. The caller therefore runs this function in a process that ends afterwards and
    loads the result. If there is a second core, a second process compiles about half of the kernels.
    """
    directory = cache_directory()
    with FileLock((directory or Path(gettempdir())) / "linefix.lock"):
        if is_complete():
            return
        from . import warmup

        alone = (os.cpu_count() or 1) == 1 or directory is None
        with nullcontext() if alone else subprocess.Popen(command_of(SECOND), stdin=subprocess.PIPE) as second:
            warmup.warm_up_first_half()
            if second is not None:
                second.wait()  # its standard input is open until here: when it closes, the process ends
        warmup.warm_up()
        mark_complete()
