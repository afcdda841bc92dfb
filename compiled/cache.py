"""The directory of compiled kernels, named after the source that they were compiled from.

Numba's cache compares the file of a function with the one it was compiled from, but not the files of the functions that
it calls. After an upgrade it would run old code. The directory is therefore named after a digest of the text of every
file that a kernel can reach, of the versions of Python, NumPy and Numba, and of the processor. When any of these
changes, so does the name.
"""

from __future__ import annotations

import atexit
import hashlib
import json
import logging
import os
import platform
import shutil
import tempfile
import time
import uuid
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import numba
import numpy as np

from .trusted_folders import is_trusted_file, why_untrusted

logger = logging.getLogger("linefix")

PACKAGES = ("registration", "vectorization", "association", "simulation")  # those that have kernels
SOURCES = ("**/kernels/**/*.py", "**/layout.py", "**/*tables.py", "**/tuning.py")  # files that a kernel can reach
CPU_NAME = ("vendor_id", "cpu family", "model", "CPU implementer", "CPU variant", "CPU part")  # of x86-64; of arm64
CPU_FEATURES = ("flags", "Features")
DIRECTORY = "LINEFIX_KERNELS"  # the environment variable that names the cache directory
COMPLETE = "complete"  # a file that is written when every kernel that a request needs is cached
UNUSED_SECONDS = 86_400.0  # so long ago a directory was last used that may be removed
STORED_DIGESTS = 8  # directories of other versions that stay, for checkouts and processors in use


@cache
def cache_directory() -> Path | None:
    """Return the directory of the kernels that fit the present source; create it where it is missing.

    The first that can be used of: the directory that ``LINEFIX_KERNELS`` names, ``$XDG_CACHE_HOME/linefix/kernels``
    (or ``~/.cache/linefix/kernels``), a new temporary directory. Numba requires a writable directory: one that holds
    all kernels and cannot be written, as in a read-only image, is read by links from a temporary one.

    A directory is used only if it belongs to this user or to root and no other user may write to it, because its
    content is executed.

    Returns
    -------
    pathlib.Path or None
        None where no directory can be written: every process then compiles for itself.
    """
    for parent in _candidates():
        directory = parent / digest()
        if problem := why_untrusted(directory):
            logger.warning("compiled kernels in %s are not used: %s", parent, problem)
        elif _is_writable(directory):
            _remove_damaged(directory)
            _remove_oldest(directory)
            return directory
        elif _is_whole(directory):
            return _linked(directory)
    fresh = _temporary()
    return None if fresh is None else fresh / digest()


def is_complete() -> bool:
    """Return whether every kernel that a request needs is cached."""
    directory = cache_directory()
    return directory is not None and (directory / COMPLETE).exists()


def mark_complete() -> None:
    """Record that every kernel that a request needs is cached, with the size of each file."""
    directory = cache_directory()
    if directory is not None:
        sizes = {path.relative_to(directory).as_posix(): path.stat().st_size for path in _files(directory)}
        part = directory / f"{COMPLETE}.{uuid.uuid4().hex}"
        with suppress(OSError):
            part.write_text(json.dumps(sizes, sort_keys=True))
            part.replace(directory / COMPLETE)


def compiled_fraction() -> float:
    """Return the fraction of the kernels that are cached, 0 to 1."""
    directory = cache_directory()
    if directory is None:
        return 0.0
    present = sum(path.read_bytes().count(b"\n@kernel\n") for path in sources())
    return min(1.0, len(list(directory.rglob("*.nbi"))) / max(1, present))


@cache
def digest() -> str:
    """Return a digest of everything that the machine code depends on."""
    versions = (platform.python_implementation(), platform.python_version(), numba.__version__, version("llvmlite"))
    # Numba caches by the path of a function's file, so that another checkout cannot use what this one has compiled.
    text = hashlib.sha256(repr((__file__, versions, np.__version__, *_processor())).encode())
    for path in sources():
        content = path.read_bytes()
        text.update(f"{path.name} {len(content)}\n".encode() + content)
    return text.hexdigest()[:20]


def sources() -> list[Path]:
    """Return the files that machine code depends on, sorted within each package."""
    folders: list[tuple[Path, tuple[str, ...]]] = [(Path(__file__).parent, ("*.py",))]
    specs = [spec for spec in map(find_spec, PACKAGES) if spec is not None]
    folders += [(Path(home), SOURCES) for spec in specs for home in (spec.submodule_search_locations or ())[:1]]
    return [path for folder, some in folders for path in sorted({path for one in some for path in folder.glob(one)})]


def _processor() -> tuple[str, str]:
    """Return the name and the features of the processor that is compiled for; where not on Linux, its architecture.

    Numba stores which processor its code is for, and compiles again on another. The directory of another is another one
    all the same, because `is_complete` holds for one processor.
    """
    try:
        lines = Path("/proc/cpuinfo").read_text().partition("\n\n")[0].splitlines()
    except OSError:
        lines = [f"{key}: {platform.machine()}" for key in ("model", "flags")]
    facts = [(key.strip(), value.strip()) for key, _, value in (line.partition(":") for line in lines)]
    name, features = (", ".join(value for key, value in facts if key in keys) for keys in (CPU_NAME, CPU_FEATURES))
    return os.environ.get("NUMBA_CPU_NAME") or name, os.environ.get("NUMBA_CPU_FEATURES", features)


def _candidates() -> Iterator[Path]:
    named = os.environ.get(DIRECTORY)
    if named:
        yield Path(named).absolute()
    cached = Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")) / "linefix" / "kernels"
    if cached.is_absolute():  # it is not for a user without a home directory
        yield cached


def _is_writable(directory: Path) -> bool:
    try:
        directory.mkdir(mode=0o700, parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=directory).close()
    except OSError:
        return False
    return True


def _files(directory: Path) -> list[Path]:
    """Return the files of Numba's cache: an index for each kernel, and the code of each of its variants."""
    return sorted((*directory.rglob("*.nbi"), *directory.rglob("*.nbc")))


def _is_whole(directory: Path) -> bool:
    """Return whether a directory is complete and its files have the sizes that they were written with."""
    try:
        sizes = json.loads((directory / COMPLETE).read_text())
        names = [(directory / name, size) for name, size in sizes.items()]
        return all(path.stat().st_size >= size > 0 and is_trusted_file(path.resolve()) for path, size in names)
    except (OSError, ValueError, AttributeError, TypeError):
        return False


def _remove_damaged(directory: Path) -> None:
    """Empty a directory that others have written to, or that has lost content, as after a power failure."""
    damaged = (directory / COMPLETE).exists() and not _is_whole(directory)
    if damaged or not all(is_trusted_file(path.resolve()) for path in _files(directory)):
        logger.warning("compiled kernels in %s are damaged and are compiled again", directory)
        for path in (directory / COMPLETE, *_files(directory)):
            path.unlink(missing_ok=True)


def _linked(directory: Path) -> Path | None:
    """Create a writable directory with links to the files of one that is not."""
    fresh = _temporary()
    if fresh is None:
        return None
    for path in (directory / COMPLETE, *_files(directory)):
        link = fresh / directory.name / path.relative_to(directory)
        link.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        link.symlink_to(path)
    return fresh / directory.name


@cache
def _temporary() -> Path | None:
    """Create a directory that is removed when this process ends, and that the processes it starts use, too."""
    for place in (None, "/dev/shm"):  # a read-only container has the latter
        with suppress(OSError):
            fresh = tempfile.mkdtemp(prefix="linefix-kernels-", dir=place)
            atexit.register(shutil.rmtree, fresh, ignore_errors=True)
            os.environ[DIRECTORY] = fresh
            return Path(fresh)
    logger.warning(
        "no directory can be written for compiled kernels, so every process compiles them; set %s", DIRECTORY
    )
    return None


def _remove_oldest(directory: Path) -> None:
    """Remove the directories of other versions beyond the newest few, but for those that were used within a day.

    A process that compiles into its directory, or loads from it, must not lose it to a process of another checkout.
    """
    with suppress(OSError):
        os.utime(directory)
    names = directory.parent.glob("[0-9a-f]" * len(directory.name))
    others = sorted((path for path in names if path != directory), key=lambda path: path.stat().st_mtime)
    for path in others[: -STORED_DIGESTS + 1]:
        if time.time() - path.stat().st_mtime > UNUSED_SECONDS:
            shutil.rmtree(path, ignore_errors=True)
