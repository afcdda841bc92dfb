"""Look into a built image, and run it as it is to be run: without rights, on a root that cannot be written.

    docker save linefix -o image.tar       (Docker 25 or newer; podman: podman save --format oci-archive)
    sudo python .ci/image.py image.tar     (--look: without running it, which needs no root)

Needs no engine: the archive is unpacked, and run in a mount namespace of its own by util-linux. Says each thing that
was looked at, and fails where one of them is not as it should be.
"""

from __future__ import annotations

import argparse
import json
import os
import runpy
import sys
import tarfile
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import IO, Any

from image_running import run, unpack
from packaging.utils import canonicalize_name

HOME = "opt/linefix/"
BILL = HOME + "sbom.cdx.json"
MOST_MB = 620  # of the folder of the service, unpacked
COMPILERS = ("as", "c++", "cargo", "cc", "clang", "cmake", "cpp", "g++", "gcc", "go", "ld", "make", "node", "rustc")
SOURCES = (".a", ".c", ".cpp", ".h", ".hpp", ".pxd", ".pyi", ".pyx")
FOLDERS = frozenset(["benchmarks", "docs", "experiments", "test", "tests"])
SECRETS = ("LINEFIX_KEYS", "LINEFIX_ALLOW_ANONYMOUS", "LINEFIX_DATABASE_URL")


class ImageError(Exception):
    """The archive is none that is known here."""


@dataclass
class Image:
    """An image as its archive has it.

    Attributes
    ----------
    config : dict
        User, environment, entry point.
    files : dict
        Content of the last layer with each path, by path without a leading slash.
    layers : list of (str, int)
        Command of each layer, and the bytes of its files.
    """

    config: dict[str, Any]
    files: dict[str, tarfile.TarInfo] = field(default_factory=dict)
    layers: list[tuple[str, int]] = field(default_factory=list)
    contents: dict[str, bytes] = field(default_factory=dict)

    def of(self, folder: str) -> Iterator[tuple[PurePosixPath, tarfile.TarInfo]]:
        """Give what stands below a folder."""
        return ((PurePosixPath(name), item) for name, item in self.files.items() if name.startswith(folder))


def blob(archive: tarfile.TarFile, name: str) -> IO[bytes]:
    """Return one of the archive's files, by its name or digest."""
    found = archive.extractfile("blobs/" + name.replace(":", "/") if ":" in name else name)
    if found is None:
        raise ImageError(f"{name} is no file of the archive")
    return found


def layers_of(archive: tarfile.TarFile) -> tuple[dict[str, Any], list[tarfile.TarFile]]:
    """Return the configuration of an image's archive, and its layers."""
    try:
        manifest = json.load(blob(archive, "index.json"))
        while "manifests" in manifest:
            manifest = json.load(blob(archive, manifest["manifests"][0]["digest"]))
        config = json.load(blob(archive, manifest["config"]["digest"]))
        packed = [blob(archive, layer["digest"]) for layer in manifest["layers"]]
    except (KeyError, IndexError, ValueError, tarfile.TarError) as error:
        raise ImageError(f"no archive of an OCI image: {error}") from error
    return config, [tarfile.open(fileobj=one) for one in packed]


def read(path: Path) -> Image:
    """Read an image from its archive."""
    with tarfile.open(path) as archive:
        config, layers = layers_of(archive)
        made = [step.get("created_by", "") for step in config.get("history", []) if not step.get("empty_layer")]
        image = Image(config["config"])
        for number, layer in enumerate(layers):
            size = 0
            for item in layer:
                name = item.name.removeprefix("./").strip("/")
                size += item.size
                if not _hidden(image.files, name):
                    image.files[name] = item
                    if name in (BILL, "etc/passwd"):
                        image.contents[name] = blob(layer, item.name).read()
            image.layers.append((made[number] if number < len(made) else "", size))
    return image


def _hidden(files: dict[str, Any], name: str) -> bool:
    """Remove what a mark of a layer removes; return whether it was such a mark."""
    folder, _, last = name.rpartition("/")
    if not last.startswith(".wh."):
        return False
    gone = folder if last == ".wh..wh..opq" else f"{folder}/{last.removeprefix('.wh.')}".strip("/")
    for other in [one for one in files if one.startswith(gone + "/") or (one == gone and gone != folder)]:
        del files[other]
    return True


def user_of(image: Image) -> tuple[int, int]:
    """Return the numbers of user and group that the image runs as."""
    said = image.config.get("User", "") or "0"
    rows = [line.split(":") for line in image.contents["etc/passwd"].decode().splitlines()]
    return next(((int(row[2]), int(row[3])) for row in rows if said.split(":")[0] in (row[0], row[2])), (0, 0))


def faults(image: Image, most_mb: float) -> Iterator[tuple[str, list[str]]]:
    """Give what is looked at, and in what the image falls short of it."""
    user, group = user_of(image)
    yield f"runs as user {user}, not as root", [] if user else [image.config.get("User", "")]
    files = {name: item for name, item in image.files.items() if item.isfile()}
    yield "no program gives rights", [name for name, item in files.items() if item.mode & 0o6000 or _capable(item)]
    yield (
        "its user can write to no program",
        [str(name) for name, item in image.of("") if _writes(item, user, group) and not str(name).startswith("data")],
    )
    path = [part.strip("/") for part in _environment(image).get("PATH", "").split(":")]
    programs = [name for name in image.files if name.rpartition("/")[0] in {*path, *(f"usr/{part}" for part in path)}]
    yield "no compiler", [name for name in programs if name.rpartition("/")[2].split("-")[0] in COMPILERS]
    yield "nothing that installs", [n for n in image.files if n.startswith(("opt/", "usr/local/")) and _installs(n)]
    inside = [(name, item) for name, item in image.of(HOME) if item.isfile()]
    yield "no tests, documents, sources", [str(n) for n, _ in inside if FOLDERS & {*n.parts} or n.suffix in SOURCES]
    yield "one program", [str(n) for n, _ in inside if str(n.parent) == f"{HOME}bin" and n.name != "linefix"]
    yield "no secret, and not open, by itself", [name for name in _environment(image) if name in SECRETS]
    yield "a bill of materials of what is installed", unlisted(image)
    # By its folder: how many layers hold it, and what they are called, is up to the engine.
    megabytes = sum(item.size for _, item in inside) / 1e6
    too_much = [] if 0.0 < megabytes <= most_mb else [f"expected more than 0 and {most_mb} at most"]
    yield f"{megabytes:.0f} MB in {HOME}", too_much


def unlisted(image: Image) -> list[str]:
    """Return what is installed and stands in no bill, or the other way round, and what may not be part of it."""
    if BILL not in image.contents:
        return ["there is none"]
    materials = runpy.run_path(str(Path(__file__).with_name("materials.py")))
    bill = json.loads(image.contents[BILL])
    try:
        materials["require_licences"](bill)
    except materials["MaterialsError"] as error:
        return [str(error)]
    ours = bill["metadata"].get("component", {"name": "no service", "version": ""})
    told = [*bill["components"], ours, *ours.get("components", [])]
    listed = {f"{canonicalize_name(one['name'])} {one['version']}" for one in told}
    folders = {name.parent.name for name, _ in image.of(HOME) if name.name == "METADATA"}
    parts = [folder.removesuffix(".dist-info").split("-") for folder in folders if folder.endswith(".dist-info")]
    return sorted(listed ^ {f"{canonicalize_name(name)} {version}" for name, version in parts})


def _environment(image: Image) -> dict[str, str]:
    return dict(one.split("=", 1) for one in image.config.get("Env", []))


def _capable(item: tarfile.TarInfo) -> bool:
    return "SCHILY.xattr.security.capability" in item.pax_headers


def _writes(item: tarfile.TarInfo, user: int, group: int) -> bool:
    if item.issym() or item.ischr() or item.mode & 0o1000:
        return False
    return bool(item.uid == user or (item.gid == group and item.mode & 0o020) or item.mode & 0o002)


def _installs(name: str) -> bool:
    return bool({"pip", "setuptools", "ensurepip", "uv"} & set(PurePosixPath(name).parts))


def main() -> int:
    """Say what was looked at; return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("archive", type=Path)
    parser.add_argument("--look", action="store_true", help="do not run it")
    parser.add_argument("--most-mb", type=float, default=MOST_MB, help="of the folder of the service, unpacked")
    asked = parser.parse_args()
    try:
        image = read(asked.archive)
        said = [_said(what, sorted(found)) for what, found in faults(image, asked.most_mb)]
    except (ImageError, OSError, tarfile.TarError) as error:
        print(f"image: {error}")
        return 2
    for made, size in image.layers:
        print(f"       {size / 1e6:6.0f} MB  {made[:90]}")
    if not asked.look:
        with tempfile.TemporaryDirectory(prefix="image-") as folder:
            said += _runs(image, asked.archive, Path(folder))
    return 0 if all(said) else 1


def _runs(image: Image, path: Path, folder: Path) -> list[bool]:
    if os.geteuid():
        return [_said("it was run", ["that needs root; --look does not run it"])]
    with tarfile.open(path) as archive:
        unpack(layers_of(archive)[1], folder / "root")
    start = [*image.config.get("Entrypoint", ()), *(image.config.get("Cmd") or ())]
    return [_said(what, found) for what, found in run(folder, start, _environment(image), user_of(image))]


def _said(what: str, found: list[str]) -> bool:
    print(f"{'FAILED' if found else 'ok    '} {what}" + "".join(f"\n         {one}" for one in found[:10]), flush=True)
    return not found


if __name__ == "__main__":
    sys.exit(main())
