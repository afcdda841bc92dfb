"""Move each threshold of the search and the verdict by 20 % either way, and count the answers that change.

A sample of scans is answered with the thresholds as they are, then with each of them moved. Counted are answers that
change, and those that are right, usable, and usable but wrong. Thresholds that a kernel reads are compiled in. With
``--compiled`` each of these runs in a process of its own, which compiles the kernels that depend on it.

``python -m benchmarks.sensitivity [--answers 120] [--compiled] [--only NAME ...] [--list]``
"""

from __future__ import annotations

import argparse
import ast
import math
import statistics
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, zip_longest
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

import association
from association import AssociationResult, HardPrior, MapIndex, Prior, SoftPrior, associate
from registration import RigidTransform

from .examples import RANGES, SEGMENTS, Case, range_cases, segment_cases, world_cases
from .outcomes import OPTIONS, offset, progress
from .table import Row, print_table

ROOT = Path(association.__file__).parents[1]
MOVED = (0.8, 1.2)
ANSWERS = 120
SLOWEST = 0.2  # s; scans that take longer are left out of the sample
SAME_POSE = 1e-6  # m, rad; poses that differ by less are equal
STRIDES = {SEGMENTS: 16, RANGES: 16}
STEP = 3  # one case in three of the four kinds in turn: some of each kind

Number = int | float
Value = Number | tuple[Number, ...]


@dataclass(frozen=True, slots=True)
class Threshold:
    """A constant of a ``tuning.py``.

    Attributes
    ----------
    module : str
        Name of the `tuning` module.
    name : str
    value : number or tuple of numbers
    compiled : bool
        True if a kernel reads it.
    """

    module: str
    name: str
    value: Value
    compiled: bool

    def moved(self, factor: float) -> Value:
        """Return the value times a factor; an integer moves by one at least."""
        if isinstance(self.value, tuple):
            return tuple(_moved(one, factor) for one in self.value)
        return _moved(self.value, factor)


@dataclass(frozen=True, slots=True)
class Told:
    """The part of an answer that is compared, and whether it is right.

    Attributes
    ----------
    status : str
    usable : bool
    pose : RigidTransform or None
    probability : float or None
    right : bool
    """

    status: str
    usable: bool
    pose: RigidTransform | None
    probability: float | None
    right: bool


@dataclass(frozen=True, slots=True)
class Effect:
    """The difference that a moved threshold makes.

    Attributes
    ----------
    changed : int
        Answers with another status, flag, pose or probability.
    right, usable, wrong : int
        By how many more answers are right; usable; usable and wrong.
    time : float
        Of all answers over that with the thresholds as they are.
    failed : str
        The error, where the value is not possible; else empty.
    """

    changed: int = 0
    right: int = 0
    usable: int = 0
    wrong: int = 0
    time: float = 1.0
    failed: str = ""


@dataclass(frozen=True, slots=True)
class Sampled:
    """A case with a prior, and its number in the order in which cases are drawn."""

    case: Case
    prior: Prior | None
    number: int

    @property
    def with_beams(self) -> bool:
        """Return whether the scan comes with its ranges."""
        return self.case.scan.beams is not None

    def answer(self, *, index_again: bool = False) -> Told:
        """Search the scan; with `index_again`, index the map before."""
        index = self.case.index
        if index_again:
            index = MapIndex.build(index.segments, index.sigma, oriented=len(index.segments) == index.directed)
        return self._told(associate(index, self.case.scan, self.prior, OPTIONS))

    def _told(self, result: AssociationResult) -> Told:
        right = False
        if self.case.truth is not None and result.pose is not None:
            distance, angle = offset(result.pose, self.case.truth)
            right = distance < self.case.distance and angle < self.case.angle
        return Told(str(result.status), result.usable, result.pose, result.probability, right)


def _moved(value: Number, factor: float) -> Number:
    if isinstance(value, float):
        return value * factor
    moved = round(value * factor)
    return moved if moved != value else value + (1 if factor > 1.0 else -1)


def thresholds(package: str = "association") -> list[Threshold]:
    """Return all numbers of the ``tuning.py`` of a package but derived ones, in the order of the files."""
    found = []
    for path in sorted(ROOT.joinpath(*package.split(".")).rglob("tuning.py")):
        name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        module = sys.modules.get(name) or __import__(name, fromlist=["*"])
        derived = _derived(path)
        for constant in _assigned(path):
            value = getattr(module, constant)
            if constant in derived:
                continue
            if _is_number(value) or (isinstance(value, tuple) and all(map(_is_number, value))):
                found.append(Threshold(name, constant, value, _is_compiled(constant)))
    return found


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _assigned(path: Path) -> Iterator[str]:
    """Yield the names that a module assigns, in their order."""
    for statement in ast.parse(path.read_text()).body:
        if isinstance(statement, ast.Assign):
            for target in statement.targets:
                yield from (node.id for node in ast.walk(target) if isinstance(node, ast.Name))


def _derived(path: Path) -> dict[str, ast.expr]:
    """Return the constants that are computed from one other alone, such as a cosine of an angle."""
    found = {}
    for statement in ast.parse(path.read_text()).body:
        if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name):
            names = [node.id for node in ast.walk(statement.value) if isinstance(node, ast.Name)]
            if any(name.isupper() for name in names) and not isinstance(statement.value, ast.Tuple):
                found[statement.targets[0].id] = statement.value
    return found


def _is_compiled(name: str) -> bool:
    return any("kernels" in module.__name__.split(".") for module in readers(name))


def readers(name: str) -> list[ModuleType]:
    """Return the loaded modules of the project that have a threshold among their names."""
    packages = ("association.", "map_quality.", "linefix.", "benchmarks.")
    return [
        module
        for key, module in sorted(sys.modules.items())
        if key.startswith(packages) and name in vars(module) and not key.endswith(".tuning")
    ]


def _of_index(threshold: Threshold) -> bool:
    """Return whether the index of a map depends on a threshold."""
    return any(module.__name__.startswith("association.index.") for module in readers(threshold.name))


class moved:  # noqa: N801
    """Let all modules see another value of a threshold, for as long as the block lasts."""

    def __init__(self, threshold: Threshold, value: Value) -> None:
        self._tuning, self._name = sys.modules[threshold.module], threshold.name
        self._value, self._before = value, getattr(self._tuning, threshold.name)

    def __enter__(self) -> None:
        self._set(self._value)

    def __exit__(self, *_: object) -> None:
        self._set(self._before)

    def _set(self, value: Value) -> None:
        """Set the threshold and what is derived from it, and forget what functions have cached."""
        values: dict[str, Any] = {self._name: value}
        setattr(self._tuning, self._name, value)
        for name, expression in _derived(Path(str(self._tuning.__file__))).items():
            if self._name in {node.id for node in ast.walk(expression) if isinstance(node, ast.Name)}:
                values[name] = eval(ast.unparse(expression), vars(self._tuning))  # of our own module
                setattr(self._tuning, name, values[name])
        for name, one in values.items():
            for module in readers(name):
                setattr(module, name, one)
        for key, module in list(sys.modules.items()):
            if key.startswith("association."):
                for member in list(vars(module).values()):
                    if hasattr(member, "cache_clear"):
                        member.cache_clear()


def sample(count: int) -> list[Sampled]:
    """Return scans of plans, logs and drawn worlds, half of them as segments and half as ranges, some with a prior.

    Scans that take longer than `SLOWEST` are left out, so that all thresholds can be moved.
    """
    found: dict[bool, list[Sampled]] = {False: [], True: []}
    for one in draw():
        same = found[one.with_beams]
        if len(same) < (count + 1) // 2:
            one.answer()
            if timed([one])[1] <= SLOWEST:
                same.append(one)
        if len(found[False]) + len(found[True]) >= count:
            break
    return sorted((*found[False], *found[True]), key=lambda one: one.number)


def sample_of(numbers: Sequence[int]) -> list[Sampled]:
    """Return the scans with some numbers, in ascending order: the same in any process."""
    wanted = set(numbers)
    return [one for one in islice(draw(), max(wanted) + 1) if one.number in wanted]


def draw() -> Iterator[Sampled]:
    """Yield scans of all kinds in turn."""
    kinds: list[Iterator[Case]] = [
        segment_cases(STRIDES[SEGMENTS]),
        range_cases(STRIDES[RANGES]),
        world_cases(SEGMENTS, 128, kept_for_report=True),
        world_cases(RANGES, 128, kept_for_report=True),
    ]
    some_of_each = (islice(cases, 0, None, STEP) for cases in kinds)
    mixed = (case for some in zip_longest(*some_of_each) for case in some if case is not None)
    for number, case in enumerate(mixed):
        yield Sampled(case, _prior(case, number), number)


def _prior(case: Case, number: int) -> Prior | None:
    """Return no prior for two scans of three; for the others one that is right or wrong, soft or a window."""
    if case.truth is None or number % 3:
        return None
    near = RigidTransform(case.truth.x + 0.3, case.truth.y - 0.2, case.truth.theta + 0.1)
    far = RigidTransform(case.truth.x + 4.0, case.truth.y, case.truth.theta + 1.0)
    pose = far if number % 4 == 0 else near
    if number % 2:
        return SoftPrior(pose, np.diag([0.25, 0.25, 0.04]))
    return HardPrior(pose, 1.5, 0.5)


def timed(some: Sequence[Sampled], *, index_again: bool = False) -> tuple[list[Told], float]:
    """Answer some scans; return the answers, and the processor time of all, seconds."""
    began = time.process_time()
    answers = [one.answer(index_again=index_again) for one in some]
    return answers, time.process_time() - began


def effect_of(before: Sequence[Told], after: Sequence[Told], ratio: float) -> Effect:
    """Compare the answers of one sample."""
    pairs = list(zip(before, after, strict=True))
    return Effect(
        sum(_differ(a, b) for a, b in pairs),
        sum(b.right - a.right for a, b in pairs),
        sum(b.usable - a.usable for a, b in pairs),
        sum((b.usable and not b.right) - (a.usable and not a.right) for a, b in pairs),
        ratio,
    )


def _differ(one: Told, other: Told) -> bool:
    if (one.status, one.usable) != (other.status, other.usable) or (one.pose is None) != (other.pose is None):
        return True
    if (one.probability is None) != (other.probability is None):
        return True
    if abs((one.probability or 0.0) - (other.probability or 0.0)) > SAME_POSE:
        return True
    if one.pose is None or other.pose is None:
        return False
    away = math.hypot(one.pose.x - other.pose.x, one.pose.y - other.pose.y)
    return away > SAME_POSE or abs(one.pose.theta - other.pose.theta) > SAME_POSE


def effects(some: Sequence[Sampled], chosen: Sequence[Threshold]) -> Iterator[tuple[Threshold, list[Effect]]]:
    """Move each of some thresholds that no kernel reads, either way; yield it with the effects."""
    timed(some)
    before = timed(some)[0]
    seconds = {again: statistics.median(timed(some, index_again=again)[1] for _ in range(3)) for again in (False, True)}
    for number, threshold in enumerate(chosen):
        found, again = [], _of_index(threshold)
        for factor in MOVED:
            try:
                with moved(threshold, threshold.moved(factor)):
                    after, took = timed(some, index_again=again)
                found.append(effect_of(before, after, took / seconds[again]))
            except Exception as error:
                found.append(Effect(failed=f"{type(error).__name__}: {error}"))
        progress("thresholds", number + 1, len(chosen))
        yield threshold, found


def print_effects(title: str, found: Sequence[tuple[Threshold, list[Effect]]]) -> None:
    """Print a table of thresholds, those that change most first."""
    rows = []
    for threshold, both in sorted(found, key=lambda one: -max(effect.changed for effect in one[1])):
        place = threshold.module.removeprefix("association.").removesuffix("tuning").strip(".") or "association"
        cells = [f"{place}.{threshold.name}", str(threshold.value)]
        for one in both:
            if one.failed:
                cells += [one.failed[:40], ""]
            else:
                cells += [f"{one.changed}: {one.right:+d} {one.usable:+d} {one.wrong:+d}", f"{one.time:.2f}"]
        rows.append(cells)
    columns = (
        "threshold",
        "value",
        "x 0.8 changed: right usable wrong",
        "time",
        "x 1.2 changed: right usable wrong",
        "time",
    )
    print_table(title, columns, rows)


def sensitivity(quick: int) -> list[Row]:
    """Move all thresholds that Python reads."""
    run(max(10, ANSWERS // quick), [one for one in thresholds() if not one.compiled])
    return []


def run(count: int, chosen: Sequence[Threshold]) -> None:
    """Print the effects of some thresholds that Python reads on a sample of so many answers."""
    some, every = sample(count), thresholds()
    found = list(effects(some, chosen))
    read = sum(not one.compiled for one in every)
    with_beams = sum(one.with_beams for one in some)
    print(f"\n{len(every)} thresholds, {read} read by Python only; {len(some)} answers, {with_beams} with ranges")
    print("Drives, causes and other units are not in the sample: their thresholds change nothing here.")
    print_effects("Thresholds moved by 20 %: answers that change", found)
    still = [one.name for one, both in found if not any(effect.changed or effect.failed for effect in both)]
    print(f"\n{len(still)} of {len(found)} change nothing: {', '.join(still)}")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.sensitivity", description=__doc__)
    parser.add_argument("--answers", type=int, default=ANSWERS, help="size of the sample")
    parser.add_argument("--only", nargs="*", metavar="NAME", help="move these thresholds only")
    parser.add_argument("--list", action="store_true", help="list the thresholds, and whether a kernel reads them")
    parser.add_argument("--compiled", action="store_true", help="move those that kernels read")
    args = parser.parse_args()
    chosen = [one for one in thresholds() if args.only is None or one.name in args.only]
    if args.list:
        cells = [(one.module, one.name, str(one.value), "kernel" if one.compiled else "Python") for one in chosen]
        print_table(f"{len(chosen)} thresholds", ("module", "name", "value", "read by"), cells)
        return
    chosen = [one for one in chosen if one.compiled == args.compiled]
    if args.compiled:
        from .compiled_thresholds import run_compiled

        run_compiled(args.answers, chosen)
    else:
        run(args.answers, chosen)


if __name__ == "__main__":
    main()
