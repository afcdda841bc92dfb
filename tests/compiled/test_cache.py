"""Cached kernels: never those of another source, never from a directory that others can write to."""

from __future__ import annotations

import ast
import json
import os
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from compiled import cache

from .small_package import SmallPackage, Starter

ROOT = Path(__file__).parents[2]
ALLOWED = {"numpy", "numba", "compiled"}
MARK = "\ncompiled.mark_complete()"


@pytest.fixture(scope="module")
def starter() -> Iterator[Starter]:
    with Starter.begun() as begun:
        yield begun


@pytest.fixture
def small(tmp_path: Path, starter: Starter) -> SmallPackage:
    return SmallPackage.write(tmp_path, starter)


@pytest.fixture
def cached(tmp_path: Path) -> Iterator[Path]:
    """A directory for compiled kernels, which a test may make read-only."""
    path = tmp_path / "cached"
    path.mkdir(mode=0o700)
    yield path
    for directory in (path, *path.rglob("*")):
        if directory.is_dir():
            directory.chmod(0o700)


def test_unchanged_source_is_loaded(small: SmallPackage, cached: Path) -> None:
    first, again = (small.run(LINEFIX_KERNELS=cached) for _ in range(2))
    assert (first.answer, first.loaded, first.log) == (22.0, False, "")
    assert (again.answer, again.loaded, again.directory) == (22.0, True, first.directory)
    assert first.directory.parent == cached


@pytest.mark.parametrize(
    ("file", "old", "new", "answer"),
    [("kernels/inner.py", "+ 1.0", "+ 3.0", 26.0), ("layout.py", "10.0", "20.0", 42.0)],
)
def test_an_edit_of_another_file_changes_the_answer(
    small: SmallPackage, cached: Path, file: str, old: str, new: str, answer: float
) -> None:
    before = small.run(LINEFIX_KERNELS=cached)
    small.edit(file, old, new)
    edited = small.run(LINEFIX_KERNELS=cached)
    assert (edited.answer, edited.loaded) == (answer, False)
    small.edit(file, new, old)
    restored = small.run(LINEFIX_KERNELS=cached)
    assert (restored.answer, restored.loaded, restored.directory) == (22.0, True, before.directory)


def test_a_complete_directory_that_is_read_only_is_used(small: SmallPackage, cached: Path, tmp_path: Path) -> None:
    """As in an image; what is compiled in addition goes to a temporary directory."""
    directory = small.run(MARK, LINEFIX_KERNELS=cached).directory
    files = sorted(cached.rglob("*"))
    for path in (*(path for path in files if path.is_dir()), cached):
        path.chmod(0o500)
    ran = small.run(
        "\nfrom small.kernels.inner import inner\nassert inner(2) == 21.0", LINEFIX_KERNELS=cached, TMPDIR=tmp_path
    )
    assert (ran.answer, ran.loaded) == (22.0, True)
    assert ran.directory.parent.parent == tmp_path
    assert not ran.directory.exists()
    assert sorted(cached.rglob("*")) == files
    assert directory.parent == cached


def test_an_incomplete_read_only_directory_is_not_used(small: SmallPackage, cached: Path, tmp_path: Path) -> None:
    cached.chmod(0o500)
    ran = small.run(LINEFIX_KERNELS=cached, XDG_CACHE_HOME=tmp_path / "own")
    assert (ran.answer, ran.directory.parent) == (22.0, tmp_path / "own" / "linefix" / "kernels")


def test_a_directory_that_others_can_write_to_is_refused(small: SmallPackage, cached: Path, tmp_path: Path) -> None:
    small.run(MARK, LINEFIX_KERNELS=cached)
    cached.chmod(0o757)
    ran = small.run(LINEFIX_KERNELS=cached, XDG_CACHE_HOME=tmp_path / "own")
    assert (ran.loaded, ran.directory.parent) == (False, tmp_path / "own" / "linefix" / "kernels")
    assert "(mode 0757)" in ran.log
    assert "chmod go-w" in ran.log


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a directory to another user")
def test_a_directory_of_another_user_is_refused(small: SmallPackage, cached: Path, tmp_path: Path) -> None:
    inner = small.run(MARK, LINEFIX_KERNELS=cached).directory
    os.chown(inner, 12345, -1)
    ran = small.run(LINEFIX_KERNELS=cached, XDG_CACHE_HOME=tmp_path / "own")
    assert (ran.loaded, ran.directory.parent) == (False, tmp_path / "own" / "linefix" / "kernels")
    assert "belongs to the user 12345" in ran.log


def test_without_a_directory_of_its_own(small: SmallPackage, tmp_path: Path) -> None:
    """A temporary directory, private and removed afterwards."""
    blocked = tmp_path / "blocked"
    blocked.touch()
    ran = small.run(XDG_CACHE_HOME=blocked, TMPDIR=tmp_path)
    assert (ran.answer, ran.directory.parent.parent) == (22.0, tmp_path)
    assert ran.directory.parent.name.startswith("linefix-kernels-")
    assert not ran.directory.parent.exists()
    assert small.run(HOME="~", TMPDIR=tmp_path).directory.parent.parent == tmp_path


def test_where_nothing_can_be_written_every_process_compiles(small: SmallPackage, tmp_path: Path) -> None:
    blocked = tmp_path / "blocked"
    blocked.touch()
    program = (
        "import tempfile\n"
        "def refuse(*_, **__): raise OSError\n"
        "tempfile.mkdtemp = refuse\n"
        "import compiled.cache\n"
        "from small.kernels.outer import outer\n"
        "print(outer(1.0), compiled.cache_directory(), compiled.is_complete(), compiled.compiled_fraction())"
    )
    environment = os.environ | {"XDG_CACHE_HOME": str(blocked), "LINEFIX_KERNELS": ""}
    out, log = small.starter.run(program, tmp_path, environment)
    assert out.split() == ["22.0", "None", "False", "0.0"]
    assert "set LINEFIX_KERNELS" in log


def test_a_damaged_file_is_compiled_again(small: SmallPackage, cached: Path) -> None:
    directory = small.run(MARK, LINEFIX_KERNELS=cached).directory
    for path in (*directory.rglob("*.nbi"), *directory.rglob("*.nbc")):
        path.write_bytes(b"\x80\x05}")
    damaged = small.run(MARK, LINEFIX_KERNELS=cached)
    assert (damaged.answer, damaged.loaded) == (22.0, False)
    assert damaged.log.count("are damaged") == 1
    mended = small.run(LINEFIX_KERNELS=cached)
    assert (mended.answer, mended.loaded, mended.log) == (22.0, True, "")


def test_a_file_that_others_can_write_to_is_compiled_again(small: SmallPackage, cached: Path) -> None:
    directory = small.run(LINEFIX_KERNELS=cached).directory
    index = next(directory.rglob("outer*.nbi"))
    index.chmod(0o666)
    ran = small.run(LINEFIX_KERNELS=cached)
    assert (ran.answer, ran.loaded) == (22.0, False)
    assert small.run(LINEFIX_KERNELS=cached).loaded


def test_a_damaged_mark_is_no_mark(small: SmallPackage, cached: Path) -> None:
    directory = small.run(MARK, LINEFIX_KERNELS=cached).directory
    assert json.loads((directory / cache.COMPLETE).read_text())
    for content in ("", "[1]", '{"a": "b"}'):
        (directory / cache.COMPLETE).write_text(content)
        ran = small.run("\nassert not compiled.is_complete()", LINEFIX_KERNELS=cached)
        assert (ran.answer, ran.loaded) == (22.0, False)


def test_the_compiled_fraction(small: SmallPackage, cached: Path) -> None:
    """Of four kernels two are called; one is never called, and one is called later."""
    inner = small.home / "kernels" / "inner.py"
    inner.write_text(inner.read_text() + TWO_MORE)
    ask = "\nassert compiled.compiled_fraction() == {}, compiled.compiled_fraction()"
    small.run(ask.format(0.5) + "\nassert not compiled.is_complete()", LINEFIX_KERNELS=cached)
    small.run(
        "\nfrom small.kernels.inner import last\nassert last(1.0) == 2.0" + ask.format(0.75), LINEFIX_KERNELS=cached
    )


TWO_MORE = """
@kernel
def never(x: float) -> float:
    return x
@kernel
def last(x: float) -> float:
    return x + 1.0
"""


@pytest.mark.parametrize("in_use", [False, True])
def test_directories_of_other_versions_are_removed_unless_other_checkouts_use_them(
    small: SmallPackage, cached: Path, in_use: bool
) -> None:
    """With nine checkouts at work, each removed the kernels that another one was compiling."""
    stamps = [cached / f"{k:020x}" for k in range(cache.STORED_DIGESTS + 3)]
    others = [cached / "notes", cached / f"{0:021x}"]
    for age, path in enumerate([*others, *reversed(stamps)]):
        path.mkdir()
        if not in_use:
            os.utime(path, (age, age))
    newest = small.run(LINEFIX_KERNELS=cached).directory
    assert set(cached.iterdir()) == {newest, *others, *(stamps if in_use else stamps[: cache.STORED_DIGESTS - 1])}


def test_other_functions_keep_their_own_directory(small: SmallPackage, cached: Path, tmp_path: Path) -> None:
    theirs = "\nimport numba\nassert numba.config.CACHE_DIR == {!r}, numba.config.CACHE_DIR".format(
        str(tmp_path / "theirs")
    )
    small.run(theirs, LINEFIX_KERNELS=cached, NUMBA_CACHE_DIR=tmp_path / "theirs")
    assert not (tmp_path / "theirs").exists()


def test_the_digest_changes_with_versions_and_processor(monkeypatch: pytest.MonkeyPatch) -> None:
    digests = {cache.digest()}
    monkeypatch.setenv("NUMBA_CPU_NAME", "generic")
    digests.add(cache.digest.__wrapped__())
    monkeypatch.setenv("NUMBA_CPU_FEATURES", "+sse2")
    digests.add(cache.digest.__wrapped__())
    monkeypatch.setattr(np, "__version__", "0")
    digests.add(cache.digest.__wrapped__())
    assert len(digests) == 4


def _imports_of(path: Path, module: str) -> set[str]:
    """Return the modules that a file imports, or imports names of, without Python's own and `ALLOWED`."""
    found = set()
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            parts = package.split(".")
            above = parts[: len(parts) + 1 - node.level] if node.level else []
            source = ".".join([*above, *filter(None, [node.module])])
            inner = {f"{source}.{alias.name}" for alias in node.names}
            found |= {name if _file_of(name) else source for name in inner}
    return {name for name in found if name.split(".")[0] not in ALLOWED | sys.stdlib_module_names}


def _file_of(module: str) -> Path | None:
    try:
        spec = find_spec(module)
    except ModuleNotFoundError:
        return None
    return Path(spec.origin) if spec is not None and spec.origin is not None else None


def test_kernels_reach_only_what_the_digest_covers() -> None:
    covered = set(cache.sources())
    modules = [path for path in covered if "kernels" in path.parts]
    assert {path.relative_to(ROOT).parts[0] for path in modules} == set(cache.PACKAGES)
    ways = [".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for path in modules]
    reached: dict[Path, str] = {}
    while ways:
        module = ways.pop()
        path = _file_of(module)
        assert path is not None, module
        if path not in reached:
            reached[path] = module
            ways += _imports_of(path, module)
    assert not reached.keys() - covered


def test_every_compiled_function_is_covered() -> None:
    """Nothing outside the kernels' files is compiled."""
    for folder in (*cache.PACKAGES, "service", "formats", "linefix"):
        for path in (ROOT / folder).rglob("*.py"):
            text = path.read_text()
            assert "njit" not in text, path
            assert "@kernel" not in text or "kernels" in path.parts, path
