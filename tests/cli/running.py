"""The command line, run in this process: to start another for each command takes seconds."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from cli.entry import run


@dataclass(frozen=True)
class Ended:
    """Result of a command."""

    code: int
    out: str
    err: str

    @property
    def answer(self) -> Any:
        """The document that was printed."""
        return json.loads(self.out)

    @property
    def lines(self) -> list[dict[str, Any]]:
        """The documents that were printed, one a line."""
        return [json.loads(line) for line in self.out.splitlines()]


class Linefix:
    """Runs commands in a folder, with a store of its own; whatever happens, no one reads a traceback."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
        self._capsys = capsys
        monkeypatch.chdir(folder)
        for name in [one for one in os.environ if one.startswith("LINEFIX_") and one != "LINEFIX_KERNELS"]:
            monkeypatch.delenv(name)
        monkeypatch.setenv("LINEFIX_DATA_DIR", str(folder / "data"))
        monkeypatch.setenv("COLUMNS", "200")
        self._monkeypatch = monkeypatch

    def __call__(self, *arguments: str, **environment: str) -> Ended:
        self._capsys.readouterr()
        with self._monkeypatch.context() as patched:
            for name, value in environment.items():
                patched.setenv(name, value)
            code = run(list(arguments))
        told = self._capsys.readouterr()
        assert not any(word in told.err for word in ("Traceback", "defect"))
        lines = [line for line in told.err.splitlines(keepends=True) if "the kernels" not in line]  # on an empty cache
        return Ended(code, told.out, "".join(lines))

    def done(self, *arguments: str, **environment: str) -> Ended:
        """Run a command that ends well."""
        ended = self(*arguments, **environment)
        assert ended.code == 0, ended.err
        return ended


def refused(ended: Ended, code: int) -> str:
    """Return the one line that a command ended with."""
    (line,) = ended.err.splitlines()
    assert (ended.code, ended.out) == (code, "")
    assert line.startswith("linefix: ")
    return line
