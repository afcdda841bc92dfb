"""Starts modules as processes that find the same code as this one."""

from __future__ import annotations

import sys

# By `python -m` what stands in the working folder would come first: another checkout, or anybody's `service.py`.
PROGRAM = "import runpy, sys; sys.path[:] = {path!r}; runpy.run_module({module!r}, run_name='__main__', alter_sys=True)"


def command_of(module: str, *arguments: str) -> list[str]:
    """Return the command of a process that runs a module, which imports from where this process does."""
    return [sys.executable, "-c", PROGRAM.format(path=sys.path, module=module), *arguments]
