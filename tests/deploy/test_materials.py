"""Licences that the service may contain, without a package left out, and a wheel of the packages alone."""

from __future__ import annotations

import os
import runpy
import subprocess
import sys
import time
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
MATERIALS = runpy.run_path(str(ROOT / ".ci" / "materials.py"))
Refused = MATERIALS["MaterialsError"]


def bill(*licences: object, version: str = "1.0") -> dict[str, Any]:
    parts = [
        {"name": f"p{number}", "version": version, "bom-ref": f"p{number}", "licenses": said}
        for number, said in enumerate(licences)
    ]
    return {"components": parts, "dependencies": [{"ref": "p0", "dependsOn": ["p1", "dev"]}, {"ref": "dev"}]}


def named(text: str) -> list[dict[str, Any]]:
    return [{"license": {"name": text}}]


@pytest.mark.parametrize("text", ["MIT", "LGPL-3.0-only", "GNU Lesser General Public License v3", "Apache-2.0 OR MIT"])
def test_licences_that_may_be_part_of_it(text: str) -> None:
    MATERIALS["require_licences"](bill(named(text)))


@pytest.mark.parametrize(
    "said",
    [
        named("GPL-2.0-or-later"),
        named("AGPL-3.0-only"),
        named("License :: OSI Approved :: GNU General Public License v3 (GPLv3)"),
        [{"expression": "MIT AND GPL-3.0-only"}],
        [{"license": {"id": "GPL-3.0-only"}}],
        named("GNU Affero General Public License v3"),
        [],
    ],
    ids=str,
)
def test_licences_that_may_not(said: object) -> None:
    with pytest.raises(Refused, match="p1"):
        MATERIALS["require_licences"](bill(named("MIT"), said))


def test_a_bill_has_what_is_pinned_and_no_more() -> None:
    hashed = "p0==1.0 \\\n    --hash=sha256:aa \\\n    --hash=sha256:bb\n"
    for first in ("p0==1.0\n", hashed):
        pins = MATERIALS["pinned"](f"{first}p2==1.0 ; python_full_version < '3' \\\n    --hash=sha256:cc\n# nothing\n")
        assert pins == {"p0": "1.0"}
    found = MATERIALS["kept"](bill(named("MIT"), named("MIT")), pins)
    assert [one["name"] for one in found["components"]] == ["p0"]
    assert found["dependencies"] == [{"ref": "p0", "dependsOn": []}]
    assert "component" not in found["metadata"]
    assert len(MATERIALS["pinned"]((ROOT / "requirements" / "runtime.txt").read_text())) > 40


@pytest.mark.parametrize("name", ["runtime", "build"])
def test_what_the_image_is_made_of_is_pinned_by_hash(name: str) -> None:
    """And the image takes nothing else: pip refuses what has another hash, or none."""
    text = (ROOT / "requirements" / f"{name}.txt").read_text()
    blocks = [block.split() for block in text.replace("\\\n", " ").splitlines() if block]
    assert blocks
    assert [block[0] for block in blocks if not any(word.startswith("--hash=sha256:") for word in block)] == []
    installs = [line for line in (ROOT / "Dockerfile").read_text().splitlines() if " install --quiet " in line]
    (ours,) = [line for line in installs if "--no-deps" in line and "/wheels/" in line]
    (said,) = [line for line in installs if f"--requirement requirements/{name}.txt" in line]
    assert "--require-hashes --only-binary :all:" in said
    assert len(installs) == 3, ours


def test_the_version_is_said_once_and_has_its_changes() -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert f"## [{version}]" in (ROOT / "CHANGELOG.md").read_text()
    client = tomllib.loads((ROOT / "clients" / "python" / "pyproject.toml").read_text())["project"]["version"]
    assert client == version
    # The service reads it from what is installed: another number in a source would be a second place.
    sources = [path for folder in ("service", "cli", "linefix", "ros2") for path in (ROOT / folder).rglob("*.py")]
    assert [path for path in sources if f'"{version}"' in path.read_text()] == []


def test_the_command_line_needs_no_part_of_one_system() -> None:
    """Libraries and commands are loaded where there are none of these; the service itself is for POSIX."""
    code = """
import sys
for name in ("fcntl", "grp", "pwd", "resource", "termios", "uvloop"):
    sys.modules[name] = None
import registration, vectorization, association, simulation, formats, map_quality, batch, linefix, ros2
import cli.program
"""
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)


def test_without_the_extra_of_the_service_commands_name_it() -> None:
    """And libraries need none of it."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    missing = [line.partition(">")[0].partition("[")[0].replace("-", "_") for line in extras["service"]]
    code = f"""
import sys
for name in {[*missing, "starlette"]}:
    sys.modules[name] = None
import registration, vectorization, association, simulation, map_quality, linefix.public, linefix.documents
from cli.entry import main
main()
"""
    ended = subprocess.run([sys.executable, "-c", code, "serve"], capture_output=True, text=True, cwd=ROOT, check=False)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert 'pip install ".[service]"' in ended.stderr


def git(*arguments: str) -> list[str]:
    ended = subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True, text=True, check=False)
    if ended.returncode:
        pytest.skip("no repository")
    return ended.stdout.split("\0" if "-z" in arguments else "\n")


def test_two_builds_are_one_wheel_of_the_packages(tmp_path: Path) -> None:
    (told, *_) = git("log", "-1", "--format=%ct")
    packages = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]
    wanted = {name for name in git("ls-tree", "-r", "-z", "--name-only", "HEAD", *packages["packages"]) if name}
    environment = {**os.environ, "BIN": str(Path(sys.executable).parent), "DIST": str(tmp_path)}
    ended = subprocess.run([ROOT / ".ci" / "wheel"], env=environment, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    (path,) = tmp_path.iterdir()
    with zipfile.ZipFile(path) as wheel:
        names = {item.filename for item in wheel.infolist() if ".dist-info/" not in item.filename}
        assert names == wanted
        year, month, day, *_ = time.gmtime(int(told))
        assert {item.date_time[:3] for item in wheel.infolist()} == {(year, month, day)}
