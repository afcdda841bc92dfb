"""Run an image that was unpacked: its root cannot be written, and its user has no capability and can get none."""

from __future__ import annotations

import json
import shlex
import shutil
import signal
import socket
import subprocess
import tarfile
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

READY_SECONDS = 300.0
END_SECONDS = 15.0  # that stop_grace_period of the compose file gives it
WALLS = [[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]]
# No other place has to be writable than the data, and /tmp, which is empty at each start.
SCRIPT = """
set -e
mount --bind {root} {root}
mount --rbind /dev {root}/dev
mount -t proc proc {root}/proc
mount -t tmpfs tmpfs {root}/tmp
mount --bind {data} {root}/data
mount -o remount,ro,bind {root}
exec chroot {root} setpriv --reuid {user} --regid {group} --clear-groups \
    --inh-caps=-all --bounding-set=-all --no-new-privs -- env --ignore-environment --chdir /data {environment} {command}
"""


def unpack(layers: list[tarfile.TarFile], root: Path) -> None:
    """Lay the layers of an image over one another."""
    root.mkdir()
    for layer in layers:
        for item in layer:
            path = root / item.name
            if path.name == ".wh..wh..opq":
                shutil.rmtree(path.parent)
                path.parent.mkdir()
            elif path.name.startswith(".wh."):
                gone = path.with_name(path.name.removeprefix(".wh."))
                shutil.rmtree(gone) if gone.is_dir() and not gone.is_symlink() else gone.unlink(missing_ok=True)
            else:
                layer.extract(item, root, filter="fully_trusted")


def run(
    folder: Path, command: list[str], environment: dict[str, str], who: tuple[int, int]
) -> Iterator[tuple[str, list[str]]]:
    """Start what was unpacked into ``root``, use it, end it; give what was looked at, and what was wrong."""
    root, data, log = folder / "root", folder / "data", folder / "log"
    user, group = who
    data.mkdir(mode=0o750)
    shutil.chown(data, user, group)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    wanted = environment | {"LINEFIX_ALLOW_ANONYMOUS": "1", "LINEFIX_HOST": "127.0.0.1", "LINEFIX_PORT": str(port)}
    script = SCRIPT.format(
        root=shlex.quote(str(root)),
        data=shlex.quote(str(data)),
        user=user,
        group=group,
        environment=shlex.join(f"{name}={value}" for name, value in wanted.items()),
        command=shlex.join(command),
    )
    with log.open("wb") as written:
        process = subprocess.Popen(["unshare", "--mount", "sh", "-c", script], stdout=written, stderr=written)
    try:
        yield from _used(f"http://127.0.0.1:{port}", process)
    finally:
        process.send_signal(signal.SIGTERM)
        code = process.wait(END_SECONDS)
    lines = log.read_text(errors="replace").splitlines()
    yield "ends when it is told to", [] if code == 0 else [f"with {code}", *lines[-5:]]
    yield "compiles nothing", [line for line in lines if "compiling" in line]
    yield "says nothing of errors", [line for line in lines if '"level":"error"' in line or "Traceback" in line]


def _used(url: str, process: subprocess.Popen[bytes]) -> Iterator[tuple[str, list[str]]]:
    begun = time.monotonic()
    while _asked("GET", f"{url}/readyz")[0] != 200:
        if process.poll() is not None or time.monotonic() > begun + READY_SECONDS:
            yield "becomes ready", [f"not in {time.monotonic() - begun:.0f} s"]
            return
        time.sleep(0.1)
    yield f"is ready after {time.monotonic() - begun:.1f} s", []
    stored = _asked("PUT", f"{url}/v1/maps/room", {"segments": WALLS})
    yield "stores a map", [] if stored[0] == 201 else [str(stored)]
    code, told = _asked("POST", f"{url}/v1/associate", {"map": {"map_id": "room"}, "scan": {"segments": WALLS}})
    yield "says where the robot is", [] if (code, told.get("status")) == (200, "ok") else [f"{code} {told}"]
    inside = Path(f"/proc/{process.pid}")
    status = dict(line.split(":\t", 1) for line in (inside / "status").read_text().splitlines())
    rights = {name: status[name] for name in status if name.startswith("Cap")}
    yield "has no capability, and can get none", [f"{k} {v}" for k, v in rights.items() if int(v, 16)]
    yield "can gain no rights", [] if status["NoNewPrivs"] == "1" else [status["NoNewPrivs"]]
    yield "is not root", ["it is"] if "0" in status["Uid"].split() + status["Gid"].split() else []
    mounts = [line.split() for line in (inside / "mountinfo").read_text().splitlines()]
    yield "cannot write its root", [] if any(m[4] == "/" and "ro" in m[5].split(",") for m in mounts) else ["it can"]


def _asked(method: str, url: str, body: Any = None) -> tuple[int, Any]:
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(url, data, {"Content-Type": "application/json"}, method=method)
    try:
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.status, json.load(answer)
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode()
    except OSError as error:
        return 0, str(error)
