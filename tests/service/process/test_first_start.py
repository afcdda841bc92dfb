"""The first start compiles the kernels, and keeps nothing of the compiler in memory."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.running import RunningService, until
from tests.service.process.test_workers import ready, workers_of


@pytest.mark.long
def test_what_a_first_start_compiles_is_not_kept_in_memory(
    start_service: Callable[..., RunningService], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LINEFIX_KERNELS", str(tmp_path / "kernels"))
    running = start_service(probe="/livez", workers=2, searches=2)
    begun = time.monotonic()
    until(lambda: ready(running) == 2, patience=300.0)
    assert time.monotonic() - begun > 5.0, "nothing was compiled"
    assert running.log().count("compiling the kernels") == 2
    for pid in workers_of(running):
        status = Path(f"/proc/{pid}/status").read_text()
        anonymous = next(int(line.split()[1]) for line in status.splitlines() if line.startswith("RssAnon"))
        assert anonymous < 200_000  # kB; with the compiler in it, 480,000
