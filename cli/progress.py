"""The progress of what takes a while, on a terminal; and the kernels that are compiled before the first search."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

LOOK_SECONDS = 0.3
REPORT_SECONDS = 10.0  # between two lines where there is no terminal


@contextmanager
def progress() -> Iterator[Callable[[str, float, float | None], None]]:
    """Show the progress on a terminal, never in piped output; yield the function that takes stage, done and total."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    tasks: dict[str, Any] = {}
    with Progress(*columns, console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty()) as bars:

        def show(stage: str, done: float, total: float | None) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, completed=int(done), total=total)
            bars.update(tasks[stage], completed=done, total=total)

        yield show


def compile_first() -> None:
    """Compile the kernels that are not cached, in a process that ends with it: the compiler takes 330 MB.

    A terminal shows a bar; elsewhere a line every ten seconds reports the progress.
    """
    from compiled import compiled_fraction, is_complete

    if is_complete():
        return
    from linefix.compiling import start_compiler

    message = "linefix: compiling the kernels, about a minute on two idle cores; later runs load them from the cache"
    print(message, file=sys.stderr)
    reported = time.monotonic()
    # If it ends early or can keep nothing this process compiles what it needs.
    with progress() as show, suppress(OSError), start_compiler() as compiler:
        try:
            while compiler.poll() is None:
                fraction = compiled_fraction()
                show("kernels, %", round(100.0 * fraction), 100)
                if not sys.stderr.isatty() and time.monotonic() - reported > REPORT_SECONDS:
                    reported = time.monotonic()
                    print(f"linefix: {fraction:.0%} of the kernels are compiled", file=sys.stderr)
                time.sleep(LOOK_SECONDS)
        finally:
            compiler.kill()
