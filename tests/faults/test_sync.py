"""Acknowledged writes were synced before: a kill cannot show that, the system calls do."""

from __future__ import annotations

import re
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from linefix.documents import examples

CALLS = "fsync,fdatasync,unlink,unlinkat,sendto,sendmsg,write,writev"


@contextmanager
def traced(pid: int, log: Path) -> Iterator[None]:
    """Write the system calls of a process, all its threads included, to a file, with the paths behind descriptors."""
    command = ["strace", "-f", "-y", "-s", "64", "-e", f"trace={CALLS}", "-o", str(log), "-p", str(pid)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as tracer:
        try:
            assert tracer.stderr is not None
            said = tracer.stderr.readline()
            if "attached" not in said:
                pytest.skip(f"strace may not look: {said.strip()}")
            yield
            time.sleep(0.2)
        finally:
            tracer.terminate()


def steps(log: Path, folder: Path) -> list[str]:
    """Return what was done to the database and to callers, in the order of its completion."""
    names = {"maps.sqlite3": "database", "maps.sqlite3-journal": "journal", "": "directory"}
    found: list[str] = []
    unfinished: dict[str, str] = {}
    for line in log.read_text().splitlines():
        thread, _, call = line.partition(" ")
        if call.rstrip().endswith("<unfinished ...>"):
            unfinished[thread] = call.split("<unfinished")[0]
            continue
        if "resumed>" in call:
            call = unfinished.pop(thread, "") + call.split("resumed>")[1]
        if re.search(r"= -1 ", call):
            continue
        if sent := re.search(r'"HTTP/1\.1 (\d+)', call):
            found.append(f"answer {sent[1]}")
        elif synced := re.match(rf"\s*f(?:data)?sync\(\d+<{re.escape(str(folder))}/?([^>]*)>", call):
            found.append(f"sync {names.get(synced[1], synced[1])}")
        elif gone := re.match(rf'\s*unlink(?:at)?\(.*"{re.escape(str(folder))}/([^"]*)"', call):
            found.append(f"unlink {names.get(gone[1], gone[1])}")
    return found


@pytest.mark.skipif(shutil.which("strace") is None, reason="needs strace")
def test_a_write_is_on_the_disk_before_it_is_acknowledged(start_service: Callable[..., Any], tmp_path: Path) -> None:
    running = start_service(probe="/livez")  # maps are served before the kernels are warm
    log = tmp_path / "calls"
    with traced(running.process.pid, log):
        for document in (examples.MAP, {"segments": examples.WALLS * 500}):
            assert running.client.put("/v1/maps/m", json=document).is_success
        assert running.client.delete("/v1/maps/m").status_code == 204
    found = steps(log, tmp_path)
    print("\n" + ", ".join(found))
    answers = [i for i, step in enumerate(found) if step.startswith("answer")]
    assert [found[i] for i in answers] == ["answer 201", "answer 200", "answer 204"]
    begin = 0
    for end in answers:
        before = [step for step in found[begin:end] if step not in ("sync ", "unlink ")]
        # The commit is the end of the journal, so its directory is synced last.
        assert before[-3:] == ["sync database", "unlink journal", "sync directory"]
        assert "sync journal" in before[:-3]
        begin = end + 1
