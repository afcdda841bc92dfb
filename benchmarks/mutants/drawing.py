"""Which mistakes are put into the code: a fair sample of those that can make a difference."""

from __future__ import annotations

import ast
import random
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from operator import itemgetter
from pathlib import Path

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names

LEFT_OUT = ("tuning.py", "layout.py", "benchmarks", "migrations", "examples.py")
"""Modules, and folders, of numbers that are measured or of names: what they hold is no matter of tests."""
READ_WHEN_RUN = ("service/schemas/", "service/settings.py", "service/http/routes/")
"""Where annotations are more than words: pydantic and FastAPI read them."""

ONLY_FASTER = ("kernel", "cache", "lru_cache")
"""Decorators that change nothing but the time that a function takes."""


@dataclass(frozen=True, slots=True)
class Mutant:
    """One mistake.

    Attributes
    ----------
    path : str
        The module, from the project's root.
    line : int
        Counted from 1.
    operator : str
        What Cosmic Ray calls it.
    occurrence : int
        Which of the places in the module that the operator applies to.
    before, after : str
        The changed lines, without the spaces around them.
    """

    path: str
    line: int
    operator: str
    occurrence: int
    before: str
    after: str


def modules_of(root: Path, package: str) -> list[str]:
    """Return the modules of a package that are mutated, or the one module that is named."""
    place = root / package
    paths = sorted(place.rglob("*.py")) if place.is_dir() else [place]
    named = [path.relative_to(root) for path in paths]
    return [str(path) for path in named if not any(part in LEFT_OUT for part in path.parts)]


def draw(root: Path, package: str, count: int, seed: int) -> list[Mutant]:
    """Return mutants of a package: places are drawn first, then one mistake for each.

    Each place draws a number of its own, so that a change of the code elsewhere leaves the others drawn as they were.

    Parameters
    ----------
    root : Path
        The project's.
    package : str
        A folder or a module, from the root.
    count : int
        How many; 0 for one at every place.
    seed : int
    """
    places = []
    for path in modules_of(root, package):
        lines = (root / path).read_text().splitlines()
        seen: Counter[str] = Counter()
        for (line, column), choices in sorted(_places(root / path).items()):
            name = f"{path} {column} {lines[line - 1].strip()}"
            rng = random.Random(f"{seed} {name} {seen[name]}")
            places.append((rng.random(), rng, path, choices))
            seen[name] += 1
    drawn: list[Mutant] = []
    for _, rng, path, choices in sorted(places, key=itemgetter(0)):
        if count and len(drawn) == count:
            break
        found = _one_of(root, path, rng.sample(choices, len(choices)))
        if found is not None:
            drawn.append(found)
    return drawn


def mutated(root: Path, mutant: Mutant) -> str:
    """Return the text of a module with a mistake in it."""
    text = mutate_code((root / mutant.path).read_text(), _operator(mutant.operator), mutant.occurrence)
    assert isinstance(text, str)
    return text


def _operator(name: str) -> object:
    return get_operator(name)()


@cache
def _operators() -> Sequence[str]:
    return sorted(name for name in operator_names() if not get_operator(name).arguments())


def _places(path: Path) -> dict[tuple[int, int], list[tuple[str, int]]]:
    """Return what can be done at each place of a module: operators, and which of its places it is for each."""
    nodes = list(ast_nodes(get_ast(path.read_text())))
    places: dict[tuple[int, int], list[tuple[str, int]]] = defaultdict(list)
    for name in _operators():
        operator = _operator(name)
        positions: Iterator[tuple[int, int]] = (
            begin
            for node in nodes
            for begin, _ in operator.mutation_positions(node)  # type: ignore[attr-defined]
        )
        for occurrence, position in enumerate(positions):
            places[position].append((name, occurrence))
    return places


def _one_of(root: Path, path: str, choices: Sequence[tuple[str, int]]) -> Mutant | None:
    """Return the first choice that is a program, and another one than before."""
    text = (root / path).read_text()
    reads = path.startswith(READ_WHEN_RUN)
    for name, occurrence in choices:
        try:
            after = mutate_code(text, _operator(name), occurrence)
            same = after is None or _meaning(after, reads) == _meaning(text, reads)
        except (SyntaxError, AttributeError):  # the latter from Cosmic Ray, for `except package.Exception`
            continue
        if not same:
            line, old, new = _difference(text, after)
            return Mutant(path, line, name, occurrence, old, new)
    return None


def _difference(before: str, after: str) -> tuple[int, str, str]:
    old, new = before.splitlines(), after.splitlines()
    head = next((k for k, (a, b) in enumerate(zip(old, new, strict=False)) if a != b), min(len(old), len(new)))
    tail = 0
    while tail < min(len(old), len(new)) - head and old[-1 - tail] == new[-1 - tail]:
        tail += 1
    told = [" ".join(filter(None, map(str.strip, lines[head : len(lines) - tail]))) for lines in (old, new)]
    return head + 1, told[0], told[1]


@lru_cache(maxsize=8)
def _meaning(text: str, annotations: bool) -> str:
    """Return what a module does, without what is for readers, for mypy, for the compiler of kernels or for speed."""
    return ast.dump(_Stripped(annotations).visit(ast.parse(text)))


class _Stripped(ast.NodeTransformer):
    """Takes away what is not for the interpreter: annotations, where nothing reads them, and what `_meaning` names."""

    def __init__(self, annotations: bool) -> None:
        self._annotations = annotations

    def visit_arguments(self, node: ast.arguments) -> ast.AST:
        """Take away which arguments go by name or by place alone: mypy sees to that."""
        node.args = [*node.posonlyargs, *node.args, *node.kwonlyargs]
        node.defaults = [*node.defaults, *(one for one in node.kw_defaults if one is not None)]
        node.posonlyargs, node.kwonlyargs, node.kw_defaults = [], [], []
        return self.generic_visit(node)

    def visit_arg(self, node: ast.arg) -> ast.arg:
        if not self._annotations:
            node.annotation = None
        return node

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        if not self._annotations:
            node.annotation = ast.Constant(None)
        return self.generic_visit(node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        if not self._annotations:
            node.returns = None
        node.decorator_list = [each for each in node.decorator_list if _name(each) not in ONLY_FASTER]
        return self.generic_visit(node)

    def visit_AsyncFunctionDef(self, node: ast.AsyncFunctionDef) -> ast.AST:
        if not self._annotations:
            node.returns = None
        return self.generic_visit(node)

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        for each in node.decorator_list:
            if _name(each) == "dataclass" and isinstance(each, ast.Call):
                each.keywords = []  # frozen and slots are for mypy and for memory
        return self.generic_visit(node)


def _name(decorator: ast.expr) -> str:
    function = decorator.func if isinstance(decorator, ast.Call) else decorator
    return function.id if isinstance(function, ast.Name) else ""
