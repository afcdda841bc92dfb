"""``python -m benchmarks.mutants [--count 100] [--seed 1] [--report] [package or module ...]``.

Draws mutants of each package, runs the tests of the mutated module for each of them, and prints how many were noticed.
A run that was stopped continues where it stopped: Cosmic Ray keeps a session for each suite in ``out/mutants``.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import json
import os
import random
import re
import shlex
import shutil
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

from cosmic_ray.commands import init
from cosmic_ray.mutating import mutate_and_test, mutate_code
from cosmic_ray.plugins import get_operator
from cosmic_ray.work_db import WorkDB, use_db
from cosmic_ray.work_item import TestOutcome, WorkerOutcome, WorkItem, WorkResult

from .seen import RECORD, Record
from .suites import SUITES, Suite, changed_lines, known_equivalents, suite_of

ROOT = Path(__file__).parents[2]
PLACE = ROOT / "out" / "mutants"
PACKAGES = ("registration", "vectorization", "service", "simulation", "map_quality", "association")
LEFT_OUT = ("tuning.py", "layout.py", "examples.py")
"""Modules and folders of measured numbers or of names."""
WITHOUT_EFFECT = re.compile(r"core/(RemoveDecorator|ReplaceBinaryOperator_BitOr_\w+|ExceptionReplacer)")
"""Operators whose mutants seldom differ at run time: `int | None` in annotations, decorators of kernels and caches."""
STARTING, COMPILING = 120.0, 900.0  # s for the tests of one mutant; after a mutated kernel all are compiled again
PATIENCE = 3.0  # times as long as all tests of the suite took
PYTEST = "-x -q -p no:cacheprovider -p benchmarks.mutants.seen --tb=line -m"
SKIPPED = WorkResult(worker_outcome=WorkerOutcome.SKIPPED)


def modules_of(root: Path, package: str) -> list[Path]:
    """Return the modules of a package that are mutated, or the module itself, relative to the root."""
    place = root / package
    paths = sorted(place.rglob("*.py")) if place.is_dir() else [place]
    return [
        path for path in (each.relative_to(root) for each in paths) if not any(part in LEFT_OUT for part in path.parts)
    ]


def draw(items: Sequence[WorkItem], count: int, seed: int) -> set[str]:
    """Return the identifiers of the mutants that are run.

    Parameters
    ----------
    items : sequence of WorkItem
        All mutants of a package.
    count : int
        Number of mutants that are drawn; 0 for all.
    seed : int
    """
    able = [item for item in items if not WITHOUT_EFFECT.fullmatch(item.mutations[0].operator_name)]
    able.sort(key=_place_of)
    random.Random(seed).shuffle(able)
    compiling = (item.job_id for item in able if _compiles(item))
    return set(itertools.islice(compiling, count or None))


def _compiles(item: WorkItem) -> bool:
    """Return whether a mutant is Python: `**options` as `+options` is not."""
    mutation = item.mutations[0]
    operator = get_operator(mutation.operator_name)(**mutation.operator_args)
    try:
        compile(mutate_code(mutation.module_path.read_text(), operator, mutation.occurrence), "", "exec")
    except SyntaxError:
        return False
    return True


def _place_of(item: WorkItem) -> tuple[str, tuple[int, int], str, int]:
    mutation = item.mutations[0]
    return str(mutation.module_path), mutation.start_pos, mutation.operator_name, mutation.occurrence


def prepare(session: Path, modules: Sequence[Path], count: int, seed: int) -> None:
    """Write a session with the drawn mutants of some modules; the others count as skipped."""
    with use_db(str(session)) as database:
        init(modules, database, {})
        items = list(database.work_items)
        drawn = draw(items, count, seed)
        database.set_multiple_results([item.job_id for item in items if item.job_id not in drawn], SKIPPED)


def run(session: Path, suite: Suite) -> None:
    """Run the tests of a suite for each mutant of a session that has no result; call it in the copy of the code.

    The tests that call the mutated function run first, the fastest before. Others follow only where the suite starts
    processes, whose calls are not recorded, or where no test calls the function.
    """
    record = _recorded(session.with_suffix(".json"), suite)
    chosen = session.with_suffix(".tests").absolute()
    with use_db(str(session), WorkDB.Mode.open) as database:
        for item in list(database.pending_work_items):
            mutation = item.mutations[0]
            first = record.order(str(mutation.module_path), mutation.start_pos[0])
            rest = [] if first and not suite.processes else [test for test in record.tests if test not in first]
            chosen.write_text("\n".join(first + rest))
            compiles = "kernels" in mutation.module_path.parts
            timeout = COMPILING + PATIENCE * record.seconds() if compiles else STARTING + PATIENCE * record.seconds()
            written = mutation.module_path.stat()
            result = mutate_and_test(item.mutations, _command(suite, f"@{chosen}"), timeout)
            os.utime(mutation.module_path, ns=(written.st_atime_ns, written.st_mtime_ns))  # Numba's cache compares it
            database.set_result(item.job_id, result)


def _recorded(path: Path, suite: Suite) -> Record:
    """Return which functions the tests of a suite call; they run where that is not on record."""
    if not path.exists():
        environment = os.environ | {RECORD: str(path.absolute())}
        command = shlex.split(_command(suite, *suite.tests))
        command.remove("-x")
        subprocess.run(command, env=environment, stdout=subprocess.DEVNULL, check=False)
    record = Record(**json.loads(path.read_text()))
    if record.failed:
        print(f"left out, since they fail without any mutant in {Path.cwd()}:", *record.failed, sep="\n", flush=True)
    if not record.tests:
        raise SystemExit("no test passes without any mutant")
    return record


def _command(suite: Suite, *tests: str) -> str:
    compiled = "" if suite.compiled else "env NUMBA_DISABLE_JIT=1 "
    return f"{compiled}{shlex.quote(sys.executable)} -m pytest {PYTEST} 'not long' {shlex.join(tests)}"


def report(sessions: dict[str, list[Path]]) -> Iterator[str]:
    """Return the lines of the report: a row for each package, then the mutants that no test noticed."""
    equivalents = known_equivalents()
    survivors: list[str] = []
    yield f"{'':20}{'drawn':>7}{'run':>7}{'killed':>8}{'equal':>7}{'noticed':>9}"
    for package, paths in sessions.items():
        drawn = ran = killed = equal = 0
        for item, result in (each for path in paths for each in _results(path)):
            drawn += 1
            if result is None or result.worker_outcome is not WorkerOutcome.NORMAL:
                continue
            ran += 1
            before, after = changed_lines(result.diff or "")
            mutation = item.mutations[0]
            if result.test_outcome is not TestOutcome.SURVIVED:
                killed += 1
            elif (str(mutation.module_path), before, after) in equivalents:
                equal += 1
            else:
                survivors.append(f"{mutation.module_path}:{mutation.start_pos[0]}  {before}  ->  {after}")
        noticed = f"{killed / (ran - equal):9.1%}" if ran > equal else f"{'':9}"
        yield f"{package:20}{drawn:7}{ran:7}{killed:8}{equal:7}{noticed}"
    yield from survivors


def _results(session: Path) -> Iterator[tuple[WorkItem, WorkResult | None]]:
    """Return each drawn mutant with its result, None where it has not run yet."""
    with use_db(str(session), WorkDB.Mode.open) as database:
        results = dict(database.results)
        for item in database.work_items:
            result = results.get(item.job_id)
            if result is None or result.worker_outcome is not WorkerOutcome.SKIPPED:
                yield item, result


def copy_of(root: Path, place: Path) -> Path:
    """Copy the files of the project that Git knows, and return the folder of the copy."""
    tree = place / "tree"
    shutil.rmtree(tree, ignore_errors=True)
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=root, capture_output=True, check=True).stdout
    for name in filter(None, listed.decode().split("\0")):
        if (root / name).exists():
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(root / name, tree / name)
    return tree


def main() -> None:
    """Draw mutants, run the tests for those that have no result yet, and print the report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("places", nargs="*", default=PACKAGES, help="packages, folders or modules")
    parser.add_argument("--count", type=int, default=100, help="mutants of each place; 0 for all")
    parser.add_argument("--seed", type=int, default=1, help="seed of the sample")
    parser.add_argument("--report", action="store_true", help="print the results of earlier runs, and run nothing")
    arguments = parser.parse_args()
    PLACE.mkdir(parents=True, exist_ok=True)
    tree = copy_of(ROOT, PLACE)
    os.environ.setdefault("LINEFIX_KERNELS", str(PLACE / "kernels"))
    sessions: dict[str, list[Path]] = defaultdict(list)
    with contextlib.chdir(tree):
        for place in arguments.places:
            modules = modules_of(tree, place)
            for begin in sorted({suite_of(str(module)) for module in modules}):
                mine = [module for module in modules if suite_of(str(module)) == begin]
                count = arguments.count and max(1, round(arguments.count * len(mine) / len(modules)))
                session = PLACE / f"{place}-{begin}-{count}-{arguments.seed}.sqlite".replace("/", "_")
                if not session.exists():
                    prepare(session, mine, count, arguments.seed)
                if not arguments.report:
                    run(session, SUITES[begin])
                sessions[place].append(session)
    print("\n".join(report(sessions)))


if __name__ == "__main__":
    main()
