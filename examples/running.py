"""Start the service in a process of its own, on a free loopback port, and stop it again."""

from __future__ import annotations

import os
import random
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

START_SECONDS = 300.0  # a first start compiles the kernels
LAST_LINES = 10  # of the log, that an error shows
STOP_SECONDS = 15.0


class StartError(Exception):
    """The service did not come up; the message ends with its log."""


def free_port() -> int:
    """Return a free port below those that the system gives to clients."""
    while True:
        port = random.SystemRandom().randrange(10_000, 32_000)
        with socket.socket() as probe, suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return port


@contextmanager
def running_service(**settings: object) -> Iterator[tuple[str, int]]:
    """Give the URL and the process id of a service that is ready; it and its data are gone afterwards."""
    port = free_port()
    url = f"http://127.0.0.1:{port}"
    # Settings of the caller's own service have no say here.
    environment = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith("LINEFIX_") or name == "LINEFIX_KERNELS"
    }
    environment |= {f"LINEFIX_{name.upper()}": str(value) for name, value in settings.items()}
    with tempfile.TemporaryDirectory(prefix="linefix-demo-") as folder:
        log = Path(folder) / "log"
        command = [sys.executable, "-m", "service", "--host", "127.0.0.1", "--port", str(port)]
        with log.open("wb") as sink:
            process = subprocess.Popen(
                [*command, "--data-dir", folder, "--drain-s", "0"], env=environment, stdout=sink, stderr=sink
            )
        try:
            _wait_until_ready(url, process, log)
            yield url, process.pid
        finally:
            _stop(process)


def _wait_until_ready(url: str, process: subprocess.Popen[bytes], log: Path) -> None:
    give_up = time.monotonic() + START_SECONDS
    while time.monotonic() < give_up:
        if process.poll() is not None:
            raise StartError(f"the service ended with status {process.returncode}; its last lines:\n{_last_lines(log)}")
        try:
            with urllib.request.urlopen(f"{url}/readyz", timeout=5):
                return
        except (urllib.error.URLError, OSError):
            time.sleep(0.1)
    raise StartError(
        f"the service was not ready within {START_SECONDS:.0f} s; run the command again, which goes on where it was. "
        f"Its last lines:\n{_last_lines(log)}"
    )


def _last_lines(log: Path) -> str:
    return "\n".join(log.read_text().splitlines()[-LAST_LINES:])


def _stop(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(STOP_SECONDS)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
