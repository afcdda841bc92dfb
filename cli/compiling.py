"""Compiling kernels before a command's first search."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import suppress

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

from compiled import compiled_fraction, is_complete
from service.parsing.errors import ParserEndedError
from service.parsing.parser_process import ParserProcess
from service.work.compiling import compile_kernels

__all__ = ["compile_first", "compile_kernels"]

LOOK_SECONDS = 0.3


def compile_first() -> None:
    """Compile the kernels that are not cached, in a process that ends with it: the compiler takes 330 MB.

    A terminal shows how far it is.
    """
    if is_complete():
        return
    parser = ParserProcess()
    print(
        "linefix: compiling the kernels, which takes one to two minutes; later runs load them from the cache",
        file=sys.stderr,
    )
    columns = TextColumn("kernels"), BarColumn(), TaskProgressColumn()
    bar = Progress(*columns, console=Console(stderr=True), disable=not sys.stderr.isatty(), transient=True)
    with ThreadPoolExecutor(1) as threads, bar:
        shown = bar.add_task("kernels", total=1.0)
        # If it ends early or can keep nothing this process compiles what it needs.
        with suppress(ParserEndedError, OSError):
            try:
                compiling = threads.submit(parser.call, compile_kernels)
                while wait([compiling], LOOK_SECONDS).not_done:
                    bar.update(shown, completed=compiled_fraction())
                compiling.result()
            finally:
                parser.close()
