"""Compiling kernels before a command's first search."""

from __future__ import annotations

import sys
import time
from contextlib import suppress

LOOK_SECONDS = 0.3
REPORT_SECONDS = 10.0  # between two lines where there is no terminal


def compile_first() -> None:
    """Compile the kernels that are not cached, in a process that ends with it: the compiler takes 330 MB.

    A terminal shows a bar; elsewhere a line every ten seconds reports the progress.
    """
    from compiled import compiled_fraction, is_complete

    if is_complete():
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

    from linefix.compiling import start_compiler

    print(
        "linefix: compiling the kernels, which takes up to a minute; later runs load them from the cache",
        file=sys.stderr,
    )
    columns = TextColumn("kernels"), BarColumn(), TaskProgressColumn()
    bar = Progress(*columns, console=Console(stderr=True), disable=not sys.stderr.isatty(), transient=True)
    # If it ends early or can keep nothing this process compiles what it needs.
    with bar, suppress(OSError), start_compiler() as compiler:
        shown = bar.add_task("kernels", total=1.0)
        reported = time.monotonic()
        try:
            while compiler.poll() is None:
                bar.update(shown, completed=(fraction := compiled_fraction()))
                if bar.disable and time.monotonic() - reported > REPORT_SECONDS:
                    reported = time.monotonic()
                    print(f"linefix: {fraction:.0%} of the kernels are compiled", file=sys.stderr)
                time.sleep(LOOK_SECONDS)
        finally:
            compiler.kill()
