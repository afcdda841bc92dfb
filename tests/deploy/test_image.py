"""The check of a built image finds each fault: archives of a small image, right and wrong."""

from __future__ import annotations

import gzip
import hashlib
import io
import json
import subprocess
import sys
import tarfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

CHECK = Path(__file__).parents[2] / ".ci" / "image.py"
PACKAGES = "opt/linefix/lib/python3.13/site-packages"
BILL = {
    "metadata": {"component": {"name": "linefix", "version": "1.0"}},
    "components": [{"name": "p-0", "version": "2.0", "licenses": [{"license": {"id": "MIT"}}]}],
}


@dataclass
class Drawn:
    """An image to be: its configuration, and two layers of files by name."""

    config: dict[str, Any] = field(
        default_factory=lambda: {
            "User": "linefix",
            "Env": ["PATH=/opt/linefix/bin:/usr/bin", "LINEFIX_DATA_DIR=/data"],
            "Entrypoint": ["linefix", "serve"],
        }
    )
    base: dict[str, bytes] = field(
        default_factory=lambda: {
            "etc/passwd": b"root:x:0:0::/:/bin/sh\nlinefix:x:10001:10001::/data:/nologin\n",
            "usr/bin/sh": b"sh",
            "usr/local/bin/pip": b"pip",
        }
    )
    ours: dict[str, bytes] = field(
        default_factory=lambda: {
            "usr/local/bin/.wh.pip": b"",
            "opt/linefix/bin/linefix": b"#!python",
            "opt/linefix/sbom.cdx.json": json.dumps(BILL).encode(),
            f"{PACKAGES}/service/app.py": b"pass",
            f"{PACKAGES}/p_0-2.0.dist-info/METADATA": b"",
            f"{PACKAGES}/linefix-1.0.dist-info/METADATA": b"",
        }
    )
    modes: dict[str, int] = field(default_factory=dict)
    owners: dict[str, int] = field(default_factory=lambda: {"data": 10001})

    def archive(self, path: Path) -> Path:
        """Write it as `docker save` does."""
        made = ["COPY base /", "COPY /opt/linefix /opt/linefix"]
        layers = [self._layer(self.base), gzip.compress(self._layer(self.ours))]
        config = json.dumps({"config": self.config, "history": [{"created_by": line} for line in made]}).encode()
        manifest = json.dumps({"config": _named(config), "layers": [_named(layer) for layer in layers]}).encode()
        with tarfile.open(path, "w") as archive:
            for blob in (config, manifest, *layers):
                _add(archive, "blobs/" + _named(blob)["digest"].replace(":", "/"), blob)
            _add(archive, "index.json", json.dumps({"manifests": [_named(manifest)]}).encode())
        return path

    def _layer(self, files: dict[str, bytes]) -> bytes:
        written = io.BytesIO()
        with tarfile.open(fileobj=written, mode="w") as layer:
            for name, content in files.items():
                _add(layer, name, content, self.modes.get(name, 0o644), self.owners.get(name, 0))
        return written.getvalue()


def _named(blob: bytes) -> dict[str, str]:
    return {"digest": "sha256:" + hashlib.sha256(blob).hexdigest()}


def _add(archive: tarfile.TarFile, name: str, content: bytes, mode: int = 0o644, owner: int = 0) -> None:
    item = tarfile.TarInfo(name)
    item.size, item.mode, item.uid = len(content), mode, owner
    archive.addfile(item, io.BytesIO(content))


def failed(drawn: Drawn, folder: Path, *options: str) -> str:
    """Return what the check says is wrong, without running anything."""
    command = [sys.executable, str(CHECK), "--look", *options, str(drawn.archive(folder / "image.tar"))]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.stderr == ""
    found = [line for line in ended.stdout.splitlines() if line.startswith(("FAILED", " " * 9)) and " MB  " not in line]
    assert ended.returncode == bool(found), ended.stdout
    return "\n".join(found)


def test_an_image_as_it_should_be(tmp_path: Path) -> None:
    assert failed(Drawn(), tmp_path) == ""
    assert "0.0001 at most" in failed(Drawn(), tmp_path, "--most-mb", "0.0001")


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (lambda it: it.config.update(User=""), "not as root"),
        (lambda it: it.config.update(User="nobody-there"), "not as root"),
        (lambda it: it.modes.update({"usr/bin/sh": 0o4755}), "usr/bin/sh"),
        (lambda it: it.modes.update({f"{PACKAGES}/service/app.py": 0o666}), "app.py"),
        (lambda it: it.owners.update({f"{PACKAGES}/service/app.py": 10001}), "app.py"),
        (lambda it: it.base.update({"usr/bin/gcc-12": b""}), "gcc-12"),
        (lambda it: it.ours.pop("usr/local/bin/.wh.pip"), "usr/local/bin/pip"),
        (lambda it: it.ours.update({f"{PACKAGES}/p0/tests/test_p0.py": b""}), "test_p0.py"),
        (lambda it: it.ours.update({f"{PACKAGES}/p0/p0.h": b""}), "p0.h"),
        (lambda it: it.ours.update({"opt/linefix/bin/f2py": b""}), "bin/f2py"),
        (lambda it: it.config["Env"].append("LINEFIX_KEYS=sesame"), "LINEFIX_KEYS"),
        (lambda it: it.ours.pop("opt/linefix/sbom.cdx.json"), "there is none"),
        (lambda it: it.ours.pop(f"{PACKAGES}/p_0-2.0.dist-info/METADATA"), "p-0 2.0"),
        (lambda it: it.ours.update({f"{PACKAGES}/p9-1.0.dist-info/METADATA": b""}), "p9 1.0"),
        (
            lambda it: it.ours.update(
                {"opt/linefix/sbom.cdx.json": json.dumps(BILL).replace("MIT", "GPL-3.0-only").encode()}
            ),
            "p-0: GPL-3.0-only",
        ),
    ],
    ids=[
        *("no-user", "unknown-user", "setuid", "writable", "owned", "compiler", "pip", "tests", "headers", "programs"),
        *("key", "no-bill", "not-there", "not-in-the-bill", "gpl"),
    ],
)
def test_what_is_wrong_is_named(spoil: Callable[[Drawn], object], told: str, tmp_path: Path) -> None:
    drawn = Drawn()
    spoil(drawn)
    assert told in failed(drawn, tmp_path)


def test_an_archive_of_something_else(tmp_path: Path) -> None:
    path = tmp_path / "other.tar"
    with tarfile.open(path, "w") as archive:
        _add(archive, "index.json", b"{}")
    ended = subprocess.run([sys.executable, CHECK, path], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (2, "")
    assert "no archive of an OCI image" in ended.stdout
