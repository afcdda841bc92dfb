"""Compiled kernels that are kept: never those of another source, and kept wherever one may write."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from registration import compiling, kept_kernels

from .small_package import SmallPackage

ROOT = Path(__file__).parents[2]
PACKAGES = ("registration", "vectorization", "association", "simulation", "benchmarks.peers")
ALLOWED = {"numpy", "numba"}


@pytest.fixture
def small(tmp_path: Path) -> SmallPackage:
    return SmallPackage.write(tmp_path)


@pytest.fixture(scope="module")
def ran_once(tmp_path_factory: pytest.TempPathFactory) -> SmallPackage:
    package = SmallPackage.write(tmp_path_factory.mktemp("ran"))
    first = package.run()
    assert (first.answer, first.loaded, first.compiled_before, first.compiled_after) == (22.0, False, False, True)
    assert first.directory.parent == package.home / "kernels" / "__pycache__"
    assert not first.log
    return package


@pytest.fixture
def compiled(ran_once: SmallPackage, tmp_path: Path) -> SmallPackage:
    """The small package, and beside it what was kept of it: to compile it takes a second."""
    return SmallPackage(shutil.copytree(ran_once.home, tmp_path / "small"))


def test_how_many_are_compiled(small: SmallPackage) -> None:
    """Of four kernels one calls another, a third is never called, and a fourth calls nothing."""
    inner = small.home / "kernels" / "inner.py"
    inner.write_text(inner.read_text() + INNER_TWO)
    many = "from registration import kept_kernels\nassert kept_kernels.how_many('small') == {}"
    small.run(many.format((2, 4)))
    small.run(f"from small.kernels.inner import last\nassert last(1.0) == 2.0\n{many.format((3, 4))}")


INNER_TWO = """
@kernel
def never(x: float) -> float:
    return x
@kernel
def last(x: float) -> float:
    return x + 1.0
"""
FIRST = """
import numpy as np
from registration.compiling import internal, kernel
@internal
@kernel
def first(a):
    return a[0]
"""
CALLS = """
import numpy as np
from small.kernels.first import first
ones = np.ones(2)
assert first(ones) == first(ones) == 1.0
for _ in range(2):
    try:
        assert first(np.ones(2, np.int64)) == 5e-324
    except TypeError as error:
        assert "kernel first: expected arguments of one type each" in str(error)
        assert {refused}
    else:
        assert not {refused}
assert first.__name__ == "first"
"""


@pytest.mark.parametrize("checked", [True, False])
def test_the_types_of_what_an_internal_kernel_is_handed(compiled: SmallPackage, checked: bool) -> None:
    """They are looked at where they are checked; else an integer is read as the float that has its bits."""
    (compiled.home / "kernels" / "first.py").write_text(FIRST)
    compiled.run(CALLS.format(refused=checked), **{compiling.CHECKED: "1" if checked else ""})


BOTH = """
from numba.core import event
from registration.compiling import way_in
from small.kernels.inner import inner
enter = way_in(inner)
with event.install_recorder("numba:compile") as compiling:
    assert enter(2.0) == enter(2.0) == enter(1.0) + 10.0
names = [e.data["dispatcher"].py_func.__name__ for _, e in compiling.buffer if e.is_start]
assert names.count("inner") == {compiled}, names
assert enter.__name__ == "inner"
"""


def test_a_kernel_that_python_and_kernels_call_is_compiled_once(small: SmallPackage) -> None:
    """But for the way in, which takes it in; both are kept."""
    before = small.run(BOTH.replace("{compiled}", "1"))
    small.run(BOTH.replace("{compiled}", "0"))
    names = sorted(path.name.split("-")[0] for path in before.directory.iterdir())
    assert names == ["small.kernels.inner.inner"] * 2 + ["small.kernels.outer.outer"]


def test_unchanged_source_is_loaded_and_not_compiled(compiled: SmallPackage) -> None:
    again = compiled.run()
    assert (again.answer, again.loaded, again.compiled_before, again.compiled_after) == (22.0, True, True, True)


@pytest.mark.parametrize(
    ("file", "old", "new", "answer"),
    [("kernels/inner.py", "+ 1.0", "+ 3.0", 26.0), ("layout.py", "10.0", "20.0", 42.0)],
)
def test_an_edited_callee_changes_the_answer(
    compiled: SmallPackage, file: str, old: str, new: str, answer: float
) -> None:
    before = compiled.kept()
    compiled.edit(file, old, new)
    edited = compiled.run()
    assert (edited.answer, edited.loaded, edited.compiled_before) == (answer, False, False)
    compiled.edit(file, new, old)
    again = compiled.run()
    assert (again.answer, again.loaded, again.directory) == (22.0, True, before)


def test_what_cannot_be_written_is_loaded_from(small: SmallPackage, tmp_path: Path) -> None:
    kept = tmp_path / "kept"
    directory = small.run(LINEFIX_KERNELS=kept).directory
    files = sorted(directory.iterdir())
    for path in (directory, kept):
        path.chmod(0o500)
    ran = small.run(LINEFIX_KERNELS=kept)
    assert (ran.answer, ran.loaded, ran.directory, ran.log) == (22.0, True, directory, "")
    small.edit("kernels/inner.py", "+ 1.0", "+ 3.0")
    edited = small.run(LINEFIX_KERNELS=kept)
    assert (edited.answer, edited.loaded, edited.compiled_after) == (26.0, False, False)
    assert edited.log.count("cannot be kept") == 1
    kept.chmod(0o700)
    assert list(kept.iterdir()) == [directory]
    assert sorted(directory.iterdir()) == files


def test_kept_beside_by_another_user(compiled: SmallPackage, tmp_path: Path) -> None:
    directory = compiled.kept()
    for path in (directory, directory.parent):
        path.chmod(0o500)
    ran = compiled.run(XDG_CACHE_HOME=tmp_path / "cache")
    assert (ran.loaded, ran.directory) == (True, directory)
    compiled.edit("kernels/inner.py", "+ 1.0", "+ 3.0")
    edited = compiled.run(XDG_CACHE_HOME=tmp_path / "cache")
    assert (edited.answer, edited.directory.parent) == (26.0, tmp_path / "cache" / "linefix" / "kernels")
    assert edited.directory.parent.stat().st_mode & 0o777 == 0o700
    assert edited.compiled_after


def test_the_first_directory_that_is_named(small: SmallPackage, tmp_path: Path) -> None:
    a, b = tmp_path / "a", tmp_path / "b"
    assert small.run(LINEFIX_KERNELS=a, NUMBA_CACHE_DIR=b).directory.parent == a
    assert small.run(LINEFIX_KERNELS="", NUMBA_CACHE_DIR=b).directory.parent == b


def test_without_a_place_of_its_own(small: SmallPackage, tmp_path: Path) -> None:
    """A temporary one that nobody else can write to, and that is gone afterwards."""
    (small.home / "kernels").chmod(0o500)
    blocked = tmp_path / "blocked"
    blocked.touch()
    ran = small.run(XDG_CACHE_HOME=blocked, TMPDIR=tmp_path)
    assert (ran.answer, ran.compiled_after, ran.directory.parent.parent) == (22.0, True, tmp_path)
    assert ran.directory.parent.name.startswith("linefix-kernels-")
    assert not ran.directory.parent.exists()
    homeless = small.run(HOME="~", TMPDIR=tmp_path)
    assert homeless.directory.parent.parent == tmp_path


def test_a_broken_file_is_compiled_anew(compiled: SmallPackage) -> None:
    for path, content in zip(sorted(compiled.kept().iterdir()), (b"", b"\x80\x05}"), strict=True):
        path.write_bytes(content)
    broken = compiled.run()
    assert (broken.answer, broken.loaded) == (22.0, False)
    assert broken.log.count("compiling anew") == 2
    mended = compiled.run()
    assert (mended.answer, mended.loaded, mended.log) == (22.0, True, "")


def test_what_kernels_call_is_kept_for_them_alone(compiled: SmallPackage) -> None:
    """As bitcode: nobody else runs it, and a caller that is compiled anew takes it in as it is."""
    (called,) = compiled.kept().glob("small.kernels.inner.*-callee-*")
    (caller,) = compiled.kept().glob("small.kernels.outer.*-kernel-*")
    kept = called.read_bytes()
    assert b"BC\xc0\xde" in kept  # how bitcode begins
    assert b"\x7fELF" not in kept
    caller.unlink()
    again = compiled.run()
    assert (again.answer, again.loaded, again.log) == (22.0, False, "")
    assert called.read_bytes() == kept
    assert caller.exists()
    directly = compiled.run("\nfrom small.kernels.inner import inner\nassert inner(2.0) == 21.0")
    assert directly.loaded
    assert len(list(compiled.kept().iterdir())) == 3


def test_old_source_is_forgotten_in_the_end(small: SmallPackage) -> None:
    place = small.home / "kernels" / "__pycache__"
    stamps = [place / f"small-{k:020x}" for k in range(kept_kernels.KEPT_STAMPS + 3)]
    others = [place / "small-notes", place / f"smaller-{0:020x}"]
    for age, path in enumerate([*others, *reversed(stamps)]):
        path.mkdir(parents=True)
        os.utime(path, (age, age))
    newest = small.run().directory
    assert set(place.iterdir()) == {newest, *others, *stamps[: kept_kernels.KEPT_STAMPS - 1]}


def test_a_constant_is_no_variant_of_its_own(small: SmallPackage) -> None:
    """A count that begins at 0 is a constant to Numba at first."""
    counting = "    n = 0\n    for _ in range(3):\n        n = inner(n) - 9\n    return inner(True) + n"
    small.edit("kernels/outer.py", "    return 2.0 * inner(x)", counting)
    small.edit("layout.py", "10.0", "10")
    small.edit("kernels/inner.py", "+ 1.0", "+ 1")
    ran = small.run()
    assert ran.answer == 11 + 10 * (10 * (10 * 0 - 8) - 8) - 8
    assert len(list(ran.directory.glob("small.kernels.inner.*"))) == 2


def test_a_kernel_elsewhere_is_refused() -> None:
    with pytest.raises(TypeError, match="test_compiling"):

        @compiling.kernel
        def outside(x: float) -> float:
            return x

    factor = 2.0
    with pytest.raises(TypeError, match="enclosing"):

        @compiling.kernel
        def closure(x: float) -> float:
            return factor * x


@pytest.mark.parametrize(
    "inside", ["core.caching._Cache", "np.arrayobj._empty_nd_impl", "core.codegen.CPUCodegen._pass_builder"]
)
def test_other_numbas_are_refused(inside: str) -> None:
    """As if a later Numba had no such thing any more, or an earlier one not yet."""
    script = (
        f"import numba.core.caching, numba.core.codegen, numba.np.arrayobj\ndel numba.{inside}\nimport registration"
    )
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=False)
    assert "install one of the versions" in ended.stderr


def test_the_directory_changes_with_the_versions(monkeypatch: pytest.MonkeyPatch) -> None:
    stamps = {kept_kernels.stamp("registration")}
    for target, name, value in (
        (np, "__version__", "0"),
        (kept_kernels, "VERSIONS", ()),
        (kept_kernels, "PROCESSOR", ("another",)),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(target, name, value)
            stamps.add(kept_kernels.stamp.__wrapped__("registration"))
    assert len(stamps) == 4


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


@pytest.mark.parametrize("package", PACKAGES)
def test_kernels_reach_only_what_the_stamp_covers(package: str) -> None:
    compilers = {Path(compiling.__file__).with_name(name) for name in kept_kernels.COMPILERS}
    covered = {*kept_kernels.sources(package), *kept_kernels.sources("registration"), *compilers}
    home = Path(compiling.__file__).parents[1].joinpath(*package.split("."))
    ways = [
        ".".join((package, *path.relative_to(home).with_suffix("").parts)).removesuffix(".__init__")
        for path in kept_kernels.sources(package)
        if path.stem.endswith("kernels") or "kernels" in path.parts
    ]
    assert ways, "the package has no kernels"
    reached: dict[Path, str] = {}
    while ways:
        module = ways.pop()
        path = _file_of(module)
        assert path is not None, module
        if path not in reached:
            reached[path] = module
            if path not in compilers:  # what they reach themselves is Numba's
                ways += _imports_of(path, module)
    assert not reached.keys() - covered


def test_every_compiled_function_is_covered() -> None:
    """Nothing outside the kernels' files is compiled."""
    for folder in ("registration", "vectorization", "association", "simulation", "service", "benchmarks"):
        for path in (ROOT / folder).rglob("*.py"):
            if path.name != "compiling.py":
                assert "njit" not in path.read_text(), path


def test_clean_leaves_no_kernels(tmp_path: Path) -> None:
    checkout, cache, named = tmp_path / "checkout", tmp_path / "cache", tmp_path / "named"
    kept = checkout / "registration" / "kernels" / "__pycache__" / "registration-0123"
    own = cache / "linefix" / "kernels" / "registration-0123"
    gone = [kept, own, checkout / ".venv", checkout / ".venv-peers", checkout / "out"]
    left = [cache / "another", named / "registration-0123"]
    for path in gone + left:
        path.mkdir(parents=True)
        (path / "file").touch()
    shutil.copy(ROOT / "Makefile", checkout)
    environment = os.environ | {"XDG_CACHE_HOME": str(cache), "LINEFIX_KERNELS": str(named)}
    subprocess.run(["make", "clean"], cwd=checkout, env=environment, check=True, capture_output=True, timeout=60)
    assert not any(path.exists() for path in gone)
    assert all((path / "file").exists() for path in left)
    assert not list(checkout.rglob("__pycache__"))
    assert (checkout / "registration" / "kernels").exists()
