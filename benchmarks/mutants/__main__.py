"""``python -m benchmarks.mutants [--count 100] [--seed 1] [--again] [package or module ...]``."""

from __future__ import annotations

import argparse
import hashlib
import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

from . import drawing
from .drawing import Mutant, draw, modules_of
from .rules import key_of, known_equivalents, suite_of
from .running import RESULTS, Outcome, Runner

ROOT = Path(__file__).parents[2]
PLACE = ROOT / "out" / "mutants"
PACKAGES = ("registration", "vectorization", "service", "simulation", "analysis", "association")
ALL_KILLED = (
    "association/verdict.py",
    "service/admission/",
    "service/maps/store.py",
    "service/schemas/limits.py",
    "service/parsing/unpacking.py",
)
"""Where no mistake may go unnoticed."""


class Results:
    """What is known of mutants from earlier runs; kept line by line, so that a run can be broken off and taken up."""

    def __init__(self, path: Path, root: Path) -> None:
        self._path = path
        self._root = root
        self._known: dict[str, Outcome] = {}
        if path.exists():
            for line in path.read_text().splitlines():
                entry = json.loads(line)
                self._known[entry["key"]] = Outcome(**entry["outcome"])

    def of(self, mutant: Mutant) -> Outcome | None:
        """Return what became of a mutant of the module as it is now."""
        return self._known.get(self._key(mutant))

    def add(self, mutant: Mutant, outcome: Outcome) -> None:
        """Keep what became of it."""
        self._known[self._key(mutant)] = outcome
        with self._path.open("a") as file:
            file.write(json.dumps({"key": self._key(mutant), "outcome": asdict(outcome)}) + "\n")

    def _key(self, mutant: Mutant) -> str:
        text = (self._root / mutant.path).read_bytes()
        return f"{mutant.path} {hashlib.sha1(text).hexdigest()[:12]} {mutant.operator} {mutant.occurrence}"


def drawn_from(root: Path, package: str, count: int, seed: int) -> list[Mutant]:
    """Return mutants of a package as `draw` does, which takes a minute, or as it did of the same modules before."""
    texts = [(root / path).read_bytes() for path in modules_of(root, package)]
    asked = f"{package} {count} {seed}".encode()
    digest = hashlib.sha1(b"\0".join([asked, Path(drawing.__file__).read_bytes(), *texts])).hexdigest()[:12]
    kept = PLACE / f"drawn-{digest}.json"
    if not kept.exists():
        kept.write_text(json.dumps([asdict(mutant) for mutant in draw(root, package, count, seed)]))
    return [Mutant(**each) for each in json.loads(kept.read_text())]


def table(drawn: dict[str, list[Mutant]], results: Results) -> Iterator[str]:
    """Return the lines of the report: a row for each package, then who survived."""
    equivalents = known_equivalents()
    yield f"{'':32}{'drawn':>7}{'run':>7}{'killed':>8}{'by time':>9}{'equal':>7}{'share':>8}"
    survivors: list[Mutant] = []
    totals = [0] * 5
    rows = list(drawn.items())
    every = [mutant for mutants in drawn.values() for mutant in mutants]
    rows += [(f"  {place}", [m for m in every if m.path.startswith(place)]) for place in ALL_KILLED]
    for name, mutants in rows:
        run = [(mutant, outcome) for mutant in mutants if (outcome := results.of(mutant)) is not None]
        equal = [mutant for mutant, outcome in run if not outcome.killed and key_of(mutant) in equivalents]
        killed = [outcome for _, outcome in run if outcome.killed]
        counts = [len(mutants), len(run), len(killed), sum(outcome.by == "time" for outcome in killed), len(equal)]
        if name in drawn:
            totals = [a + b for a, b in zip(totals, counts, strict=True)]
            survivors += [m for m, outcome in run if not outcome.killed and key_of(m) not in equivalents]
        if counts[0]:
            yield _row(name, counts)
    yield _row("together", totals)
    for mutant in survivors:
        yield f"{mutant.path}:{mutant.line}  {mutant.before}  ->  {mutant.after}"


def _row(name: str, counts: list[int]) -> str:
    drawn, run, killed, late, equal = counts
    share = f"{killed / (run - equal):8.1%}" if run > equal else f"{'':8}"
    return f"{name:32}{drawn:7}{run:7}{killed:8}{late:9}{equal:7}{share}"


def _told(outcome: Outcome | None) -> str:
    if outcome is None:
        return "not known: the machine was too busy"
    return f"killed by {outcome.by}" if outcome.killed else "SURVIVED"


def main() -> None:
    """Draw, run what is not known yet, report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("places", nargs="*", default=PACKAGES, help="packages, folders or modules")
    parser.add_argument("--count", type=int, default=100, help="of each; 0: one at every place")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--again", action="store_true", help="run those again that survived")
    parser.add_argument("--table", action="store_true", help="print what is known and run nothing")
    asked = parser.parse_args()
    PLACE.mkdir(parents=True, exist_ok=True)
    drawn = {place: drawn_from(ROOT, place, asked.count, asked.seed) for place in asked.places}
    results = Results(ROOT / RESULTS, ROOT)
    runner = None if asked.table else Runner(ROOT, PLACE)
    for mutant in (mutant for mutants in drawn.values() for mutant in mutants if runner is not None):
        known = results.of(mutant)
        if known is not None and (known.killed or not asked.again):
            continue
        assert runner is not None
        outcome = runner.outcome(mutant, suite_of(mutant.path))
        if outcome is not None:
            results.add(mutant, outcome)
        what = _told(outcome)
        print(f"{mutant.path}:{mutant.line}  {mutant.before[:50]} -> {mutant.after[:50]}  {what}", file=sys.stderr)
    commit = subprocess.run(["git", "describe", "--always", "--dirty"], cwd=ROOT, capture_output=True, text=True)
    print(f"commit {commit.stdout.strip()}, seed {asked.seed}")
    print("\n".join(table(drawn, results)))


if __name__ == "__main__":
    main()
