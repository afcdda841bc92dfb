"""What is kept of compiled kernels, where, and for which source.

Numba's own cache asks whether the file of a function has changed, and not whether one of a function that it calls has:
after an upgrade it goes on with old code. Here what is kept stands in a directory that is named after everything it was
made from: the text of every file that a kernel of the package can reach, the processor, and the versions of what
compiled it. When any of these changes the name does, so old code is never looked at, and two processes that compile at
the same time write the same.

A kernel lives in the folder ``kernels`` of its package and reaches what stands there, the package's ``layout.py``,
``*tables.py`` and ``tuning.py``, and the same files of `registration`; a test holds the packages to that.
"""

from __future__ import annotations

import atexit
import hashlib
import logging
import os
import pickle
import platform
import shutil
import tempfile
import uuid
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np

from .trusted_folders import is_trusted_file, is_trusted_folder, why_untrusted

UNKNOWN_NUMBA = (
    f"Numba {numba.__version__} compiles and keeps functions in a way that is not known here; "
    "install one of the versions that linefix names"
)
try:
    from numba.core.caching import _Cache
    from numba.core.compiler import CompileResult
    from numba.core.registry import cpu_target
    from numba.core.serialize import dumps

    from .code_libraries import Bitcode, MachineCode, put_together, set_environments

    _pickle: Callable[[Any], bytes] = dumps
    _take_apart: Callable[[Any], tuple[Any, ...]] = CompileResult._reduce
    PROCESSOR = cpu_target.target_context.codegen().magic_tuple()
except (ImportError, AttributeError) as error:
    raise ImportError(UNKNOWN_NUMBA) from error

logger = logging.getLogger("linefix")

SHARED = "registration"  # the package whose kernels those of every other may call
SOURCES = ("layout.py", "*tables.py", "tuning.py", "_*kernels.py", "kernels/**/*.py")
COMPILERS = (
    "allocating.py",
    "borrowing.py",
    "code_libraries.py",
    "compiling.py",
    "kept_kernels.py",
)  # of `SHARED`: what compiles them
VERSIONS = (platform.python_implementation(), platform.python_version(), numba.__version__, llvmlite.__version__)
DIRECTORY = "LINEFIX_KERNELS"  # names where compiled kernels are kept
KEPT_STAMPS = 8  # of a package in one place: of other versions and processors, and of checkouts in use


def cache_directory(package: str) -> Path:
    """Return where the kernels of a package are kept that fit its present source; it need not be there yet.

    The first that applies of: ``LINEFIX_KERNELS``, ``NUMBA_CACHE_DIR``, ``__pycache__`` beside the kernels where it can
    be written or holds what is needed, ``$XDG_CACHE_HOME/linefix/kernels`` (or in ``~/.cache``), a fresh temporary one.

    Parameters
    ----------
    package : str
        As it is imported, such as ``association``.
    """
    name = f"{package}-{stamp(package)}"
    named = os.environ.get(DIRECTORY) or os.environ.get("NUMBA_CACHE_DIR")
    if named:
        folder = Path(named).absolute()
        return (folder if _is_trusted(folder) else _own_directory()) / name
    home = _home(package)
    folder = home / "kernels"
    beside = (folder if folder.is_dir() else home) / "__pycache__"
    kept = _can_write(beside if beside.exists() else beside.parent) or _holds_all(beside / name, package)
    # Users who can write to the folders above can write to the source as well.
    if kept and (not beside.exists() or is_trusted_folder(beside)):
        return beside / name
    return _own_directory() / name


def is_compiled(package: str) -> bool:
    """Tell whether something of every module of kernels is kept for the present source, versions and processor."""
    return _holds_all(cache_directory(package), package)


def how_many(package: str) -> tuple[int, int]:
    """Return of how many kernels of a package something is kept for the present source, and how many there are."""
    kept = {path.name.rsplit("-", 3)[0] for path in cache_directory(package).glob("*.nbc")}
    return len(kept), sum(path.read_bytes().count(b"\n@kernel\n") for path in sources(package))


@cache
def stamp(package: str) -> str:
    """Return a digest of everything that the compiled kernels of a package are made from."""
    digest = hashlib.sha256(repr((VERSIONS, np.__version__, PROCESSOR)).encode())
    for name in sorted({package, SHARED}):
        for path in sources(name):
            text = path.read_bytes()
            digest.update(f"{name}/{path.relative_to(_home(name)).as_posix()} {len(text)}\n".encode() + text)
    for name in COMPILERS:
        digest.update((_home(SHARED) / name).read_bytes())
    return digest.hexdigest()[:20]


def sources(package: str) -> list[Path]:
    """Return the files of a package that its kernels, and those of other packages, can reach."""
    home = _home(package)
    return sorted({path for pattern in SOURCES for path in home.glob(pattern)})


class KernelCache(_Cache):
    """Keeps the variants of one kernel, a file each; takes the place of Numba's own cache.

    Whatever goes wrong with a file costs no more than compiling anew.
    """

    kind = "kernel"
    library: type[Bitcode | MachineCode] = MachineCode

    def __init__(self, function: Callable[..., Any]) -> None:
        module, line = function.__module__, function.__code__.co_firstlineno
        self._directory = cache_directory(_package_of(module))
        self._name = f"{module}.{function.__qualname__}-{line}-{self.kind}"

    @property
    def cache_path(self) -> str:
        """Where the files are."""
        return str(self._directory)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what is kept of a variant, ready to run, or None."""
        target_context.refresh()
        path = self._path(sig)
        try:
            content = read_trusted(path)
            if content is None:
                return None
            kept_sig, parts = pickle.loads(content)
            return put_together(target_context, self.library, *parts) if kept_sig == sig else None
        except FileNotFoundError:
            return None
        except Exception as error:  # a file that was cut off can fail in any way
            logger.warning("compiling anew what %s should hold: %s", path, error)
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a variant that was just compiled; where that is not possible it works from memory."""
        self._finish(data)
        if data.library.has_dynamic_globals:  # addresses, which another process has elsewhere
            return
        path = self._path(sig)
        try:
            if not self._directory.exists():
                self._directory.mkdir(parents=True, exist_ok=True)
                _forget_oldest(self._directory)
            _write_whole(path, _pickle((sig, _take_apart(data))))
        except OSError as error:
            _tell(self._directory, error.strerror)

    def flush(self) -> None:
        """Remove what is kept."""
        for path in self._directory.glob(f"{self._name}-*.nbc"):
            with suppress(OSError):
                path.unlink()

    def enable(self) -> None:
        """Do nothing: it is always enabled."""

    def disable(self) -> None:
        """Do nothing: it is always enabled."""

    def _path(self, sig: Any) -> Path:
        return self._directory / f"{self._name}-{hashlib.sha256(str(sig).encode()).hexdigest()[:16]}.nbc"

    def _finish(self, data: Any) -> None:
        set_environments(data)


class CalleeCache(KernelCache):
    """The same for what other kernels call."""

    kind = "callee"
    library = Bitcode

    def _finish(self, data: Any) -> None:
        pass


def read_trusted(path: Path) -> bytes | None:
    """Return what a file holds that is to be run; None, and a warning, where others may write to it."""
    if is_trusted_file(path):
        return path.read_bytes()
    logger.warning("%s is not loaded: other users may write to that file; the kernel is compiled again", path)
    return None


def _package_of(module: str) -> str:
    package, found, _ = f"{module}.".partition(".kernels.")
    parent, _, last = module.rpartition(".")
    if found:
        return package
    if parent and last.startswith("_") and last.endswith("kernels"):
        return parent
    raise TypeError(f"expected a kernel in a module of its package's kernels, got one in {module}")


def _home(package: str) -> Path:
    spec = find_spec(package)
    if spec is None or not spec.submodule_search_locations:
        raise ModuleNotFoundError(f"expected a package, got {package!r}", name=package)
    return Path(spec.submodule_search_locations[0])


def _modules_with_kernels(package: str) -> Iterator[str]:
    for path in sources(package):
        if b"\n@kernel\n" in path.read_bytes():
            yield ".".join((package, *path.relative_to(_home(package)).with_suffix("").parts))


def _holds_all(directory: Path, package: str) -> bool:
    names = [path.name for path in directory.glob("*.nbc")]
    return all(any(name.startswith(f"{module}.") for name in names) for module in _modules_with_kernels(package))


@cache
def _is_trusted(folder: Path) -> bool:
    """Return whether kernels may be stored in a folder; where not, the reason is logged once."""
    why = why_untrusted(folder)
    if why is not None:
        logger.warning("compiled kernels are not kept in %s: %s", folder, why)
    return why is None


def _can_write(directory: Path) -> bool:
    return os.access(directory, os.W_OK | os.X_OK)


@cache
def _own_directory() -> Path:
    """Return a directory of this user's that nobody else can write to: what is in it gets executed."""
    kept = Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")) / "linefix" / "kernels"
    if kept.is_absolute():  # not so for a user without a home
        with suppress(OSError):
            kept.mkdir(mode=0o700, parents=True, exist_ok=True)
            if _can_write(kept) and kept.stat().st_uid == os.geteuid():
                return kept
    try:
        fresh = tempfile.mkdtemp(prefix="linefix-kernels-")
    except OSError:
        return kept  # nothing can be written here at all; kernels work from memory
    atexit.register(shutil.rmtree, fresh, ignore_errors=True)
    os.environ[DIRECTORY] = fresh  # the processes that this one starts share it
    return Path(fresh)


def _forget_oldest(directory: Path) -> None:
    """Remove what was kept longest ago of the same package in the same place."""
    package, _, digest = directory.name.rpartition("-")
    stamps = [path for path in directory.parent.glob(f"{package}-{'[0-9a-f]' * len(digest)}") if path != directory]
    for path in sorted(stamps, key=lambda path: path.stat().st_mtime)[: -KEPT_STAMPS + 1]:
        shutil.rmtree(path, ignore_errors=True)


def _write_whole(path: Path, content: bytes) -> None:
    """Write a file that others see either whole or not at all."""
    part = path.with_name(f"{path.name}.{uuid.uuid4().hex}")
    try:
        part.write_bytes(content)
        part.replace(path)
    except OSError:
        with suppress(OSError):
            part.unlink()
        raise


@cache
def _tell(directory: Path, reason: str) -> None:
    logger.warning("compiled kernels cannot be kept in %s (%s): every process compiles them anew", directory, reason)
